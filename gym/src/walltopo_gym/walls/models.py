"""Tables of walls."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import ForeignKey, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed

_GYM = "gyms.id"


class FloorPlan(Base):
    """A picture of a gym from above; `sha256` is the hash of its content, stored below `plans/`."""

    __tablename__ = "floor_plans"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    sha256: Mapped[str] = mapped_column(String(64))
    width: Mapped[int]
    height: Mapped[int]


class Wall(Keyed, Base):
    """A section with its own series of scans; `place` orders them from left to right.

    `zone`: walls that are set together, empty for none; `published_scan_id` is the public version;
    `revision` grows with every change of it; `plan_x`, `plan_y`: its place on the floor plan, as
    shares of width and height from the upper left corner.
    """

    __tablename__ = "walls"
    __table_args__ = (UniqueConstraint("gym_id", "name"),)

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(String(80))
    place: Mapped[int] = mapped_column(default=0)
    zone: Mapped[str] = mapped_column(String(80), default="", server_default="")
    published_scan_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("scans.id", use_alter=True, ondelete="SET NULL")
    )
    revision: Mapped[int] = mapped_column(default=0)
    plan_x: Mapped[float | None]
    plan_y: Mapped[float | None]
