"""Tables of a gym's aims: grade targets, stock of holds, and washings."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.gyms.models import GRADE_ROWS

WASH_AFTER: Final = 150  # tries on a route; the default


class Aims(Base):
    """A gym's own settings for insights; none are set without a row.

    `targets`: rows of {"system", "grade", "steepness", "routes"}: target number of routes of a
    grade, a kind of wall, or both (empty: any). `stock`: rows of {"colour", "type", "total"}:
    number of holds (type empty: all types). `wash_after`: tries on a route until its holds are due
    for washing.
    """

    __tablename__ = "gym_aims"

    gym_id: Mapped[UUID] = mapped_column(
        ForeignKey("gyms.id", ondelete="CASCADE"), primary_key=True
    )
    targets: Mapped[list[dict[str, Any]]] = mapped_column(
        JSON, default=list, info={GRADE_ROWS: ("system", "grade")}
    )
    stock: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    wash_after: Mapped[int] = mapped_column(default=WASH_AFTER)


class Washing(Keyed, Base):
    """A washing of a wall's holds."""

    __tablename__ = "washings"
    __table_args__ = (Index("ix_washings_last", "wall_id", "washed_at"),)

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"))
    washed_at: Mapped[datetime] = mapped_column(default=now)
