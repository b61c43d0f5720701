"""Long lists in pages: newest first, each page with the cursor of the next."""

from __future__ import annotations

import base64
import binascii
from datetime import datetime
from typing import Annotated, Any, Generic, TypeVar
from uuid import UUID

from fastapi import Query
from pydantic import BaseModel
from sqlalchemy import Select, tuple_
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.database.base import Keyed

__all__ = ["Cursor", "Page", "Size", "page_of"]

Item = TypeVar("Item")
Row = TypeVar("Row", bound=Keyed)

Cursor = Annotated[str | None, Query(max_length=200, description="`next` of the page before")]
Size = Annotated[int, Query(ge=1, le=200, description="rows of a page")]


class Page(BaseModel, Generic[Item]):
    """One page; `next` is null on the last one."""

    items: list[Item]
    next: str | None


def page_of(
    session: Session, rows: Select[Row], kind: type[Row], cursor: str | None, size: int
) -> tuple[list[Row], str | None]:
    """One page of `rows`, and the cursor of the next.

    Parameters
    ----------
    kind : the table's class, whose moment of making and key give the order.

    Raises
    ------
    InputError : the cursor is none of ours.
    """
    place = tuple_(kind.created_at, kind.id)
    if cursor is not None:
        moment, key = _read(cursor)
        rows = rows.where(place < tuple_(moment, key))
    ordered = rows.order_by(kind.created_at.desc(), kind.id.desc()).limit(size + 1)
    found = list(session.scalars(ordered))
    more = len(found) > size
    return found[:size], _write(found[size - 1]) if more else None


def _write(row: Keyed) -> str:
    text = f"{row.created_at.isoformat()} {row.id.hex}"
    return base64.urlsafe_b64encode(text.encode()).decode()


def _read(cursor: str) -> tuple[Any, Any]:
    try:
        moment, key = base64.urlsafe_b64decode(cursor.encode()).decode().split(" ")
        read = datetime.fromisoformat(moment)
        if read.tzinfo is None:
            raise ValueError("no zone")
        return read, UUID(key)
    except (ValueError, binascii.Error) as error:
        raise InputError("cursor: not one that was given out here") from error
