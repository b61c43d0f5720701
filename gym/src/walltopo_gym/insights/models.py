"""Tables of what a gym wants and has: its wish of grades, its holds, and when walls were washed."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed

WASH_AFTER: Final = 150  # tries on a route, where a gym has said nothing


class Aims(Base):
    """What a gym has said of itself; a gym without a row has said nothing.

    `wish`: rows of {"system", "grade", "steepness", "routes"}: how many routes shall hang of a
    grade, a kind of wall, or both (empty: any). `stock`: rows of {"colour", "type", "total"}: how
    many holds the gym has (type empty: of all types). `wash_after`: tries on a route after which
    its holds are due for washing.
    """

    __tablename__ = "gym_aims"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey("gyms.id", ondelete="CASCADE"),
                                         primary_key=True)  # fmt: skip
    wish: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    stock: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    wash_after: Mapped[int] = mapped_column(default=WASH_AFTER)


class Washing(Keyed, Base):
    """The holds of a wall were washed."""

    __tablename__ = "washings"
    __table_args__ = (Index("ix_washings_last", "wall_id", "washed_at"),)

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"))
    washed_at: Mapped[datetime] = mapped_column(default=now)
