"""The people who see what a climber made: a problem, a list."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum
from uuid import UUID

from sqlalchemy import ColumnElement, ForeignKey, String, and_, exists, true
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.gyms.models import Ban


class Share(StrEnum):
    """The people who see a row: its author, people with the link, or all members of the gym."""

    PRIVATE = "private"
    LINK = "link"
    GYM = "gym"


class Shared:
    """A row that a person made and shares. `share`: a value of `Share`; `hidden_at`: hidden by the
    gym."""

    person_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"))
    share: Mapped[str] = mapped_column(String(10))
    hidden_at: Mapped[datetime | None]


def may_see(row: Shared, person: UUID | None, *, is_member: bool, is_setter: bool) -> bool:
    """Return whether a person may see a row that they know the address of."""
    if row.person_id == person:
        return True
    if row.share == Share.PRIVATE or (row.hidden_at is not None and not is_setter):
        return False
    return row.share == Share.LINK or is_member


def not_hidden(kind: type[Shared], gym: UUID, *, is_setter: bool) -> ColumnElement[bool]:
    """Return the condition that rows of others are in a gym's lists: setters see hidden ones and
    those of banned people, too."""
    if is_setter:
        return true()
    banned = exists().where(Ban.gym_id == gym, Ban.person_id == kind.person_id)
    return and_(kind.hidden_at.is_(None), ~banned)
