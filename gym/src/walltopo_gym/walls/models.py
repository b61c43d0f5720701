"""Tables of walls."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String, UniqueConstraint
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


class RopeLine(Keyed, Base):
    """A rope's line on a wall: one anchor, its clips, and the routes that are climbed on it.

    `label`: the number or name at its foot; `belays`: of `disciplines.ROPED`, at least one.
    `points`: clips from the lowest up and the anchor, each [x, y, z] in metres in the frame of the
    wall's scans; empty until a setter marks them. `removed_at`: it is gone; the row stays for the
    routes that were climbed on it.
    """

    __tablename__ = "rope_lines"

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"), index=True)
    label: Mapped[str] = mapped_column(String(20))
    belays: Mapped[list[str]] = mapped_column(JSON)
    points: Mapped[list[list[float]]] = mapped_column(JSON)
    removed_at: Mapped[datetime | None]
