"""Tables of lists and of the people who do them."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.climbing.edits import Edited
from walltopo_gym.climbing.sharing import Shared
from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class ClimbList(Edited, Shared, Keyed, Base):
    """An ordered list of a gym's routes and problems. The phone makes `id`, so that it is stored
    once.

    `items`: ids of routes and problems, from the first to the last. `circuit`: a setter made it for
    the gym. `deleted_at`: the row stays, so that a late copy does not revive it.
    """

    __tablename__ = "lists"
    __table_args__ = (
        Index("ix_lists_of_gym", "gym_id", "created_at", "id"),
        Index("ix_lists_of_person", "person_id", "gym_id"),
    )

    gym_id: Mapped[UUID] = mapped_column(ForeignKey("gyms.id", ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(String(80))
    note: Mapped[str] = mapped_column(String(300), default="")
    circuit: Mapped[bool] = mapped_column(default=False)
    items: Mapped[list[str]] = mapped_column(JSON)
    deleted_at: Mapped[datetime | None]


class ListMember(Base):
    """A person who does a list. `shows_progress`: its author sees what the person climbed."""

    __tablename__ = "list_members"

    list_id: Mapped[UUID] = mapped_column(
        ForeignKey("lists.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    shows_progress: Mapped[bool]
    joined_at: Mapped[datetime] = mapped_column(default=now)
