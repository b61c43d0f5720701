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

from walltopo_gym.api.fields import Digits
from walltopo_gym.database.base import Keyed
from walltopo_gym.errors import RequestError

Item = TypeVar("Item")
Row = TypeVar("Row", bound=Keyed)

Cursor = Annotated[str | None, Query(max_length=200, description="`next` of the page before")]
Size = Annotated[Digits, Query(ge=1, le=200, description="rows of a page")]


class Page(BaseModel, Generic[Item]):
    """One page; `next` is null on the last one."""

    items: list[Item]
    next: str | None


def page_of(
    session: Session, rows: Select[Row], kind: type[Row], cursor: str | None, size: int
) -> tuple[list[Row], str | None]:
    """Return one page of `rows` and the cursor of the next.

    Parameters
    ----------
    kind : the table's class; its creation time and key give the order.

    Raises
    ------
    RequestError : the cursor is invalid.
    """
    of = rows.add_columns(kind.created_at, kind.id)
    found, following = page_by(session, of, (kind.created_at, kind.id), cursor, size)
    return [row[0] for row in found], following


def page_by(
    session: Session,
    rows: Select[*tuple[Any, ...]],
    order: tuple[Any, Any],
    cursor: str | None,
    size: int,
) -> tuple[list[Any], str | None]:
    """Return one page of rows, the latest first, and the cursor of the next.

    Parameters
    ----------
    order : a moment and a key, which are also the last two columns of `rows`.

    Raises
    ------
    RequestError : the cursor is invalid.
    """
    moment, key = order
    if cursor is not None:
        rows = rows.where(tuple_(moment, key) < tuple_(*_decode_cursor(cursor)))
    found = list(session.execute(rows.order_by(moment.desc(), key.desc()).limit(size + 1)))
    more = len(found) > size
    return found[:size], _encode_cursor(*found[size - 1][-2:]) if more else None


def _encode_cursor(moment: datetime, key: UUID) -> str:
    text = f"{moment.isoformat()} {key.hex}"
    return base64.urlsafe_b64encode(text.encode()).decode()


def _decode_cursor(cursor: str) -> tuple[Any, Any]:
    try:
        moment, key = base64.urlsafe_b64decode(cursor.encode()).decode().split(" ")
        read = datetime.fromisoformat(moment)
        if read.tzinfo is None:
            raise ValueError("no zone")
        found = read, UUID(key)
        if _encode_cursor(*found) != cursor:
            raise ValueError("another spelling of it")
        return found
    except (ValueError, binascii.Error) as error:
        raise RequestError("cursor-unknown") from error
