"""Tables of routes, and of where they are in each version of a wall."""

from __future__ import annotations

from datetime import date, datetime
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed

__all__ = ["Placement", "Route"]


class Route(Keyed, Base):
    """A route from the day it is set to the day it is stripped, through any number of scans.

    `grade` is a label of the grade system; `stripped_at` is empty while it hangs.
    """

    __tablename__ = "routes"

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80), default="")
    colour: Mapped[str] = mapped_column(String(40), default="")
    grade_system_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("grade_systems.id", ondelete="SET NULL"), index=True
    )
    grade: Mapped[str] = mapped_column(String(80), default="")
    setter: Mapped[str] = mapped_column(String(80), default="")
    tags: Mapped[list[str]] = mapped_column(JSON, default=list)
    set_on: Mapped[date]
    strip_on: Mapped[date | None]
    stripped_at: Mapped[datetime | None] = mapped_column(index=True)


class Placement(Base):
    """A route in one scan: its number there, and the ids of its holds."""

    __tablename__ = "placements"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    number: Mapped[int] = mapped_column(primary_key=True)
    route_id: Mapped[UUID] = mapped_column(ForeignKey("routes.id", ondelete="CASCADE"), index=True)
    holds: Mapped[list[int]] = mapped_column(JSON)
