"""Table of hold reports."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed


class HoldReport(Keyed, Base):
    """A climber reports a hold of a wall. The phone makes `id`, so that it is stored once.

    `hold`: the hold's id in the version `scan_id`; null if the climber named the route alone.
    `route_id`: the hold's route, null for a hold without a route. `kind`: "spins", "broken",
    "sharp" or "dirty". `colour` is the hold's, or else the route's. `done_at`: null while the
    report is open. After the deletion of its author's account `person_id` is null.
    """

    __tablename__ = "hold_reports"
    __table_args__ = (Index("ix_hold_reports_of_wall", "wall_id", "done_at", "created_at"),)

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"))
    scan_id: Mapped[UUID] = mapped_column(ForeignKey("scans.id", ondelete="CASCADE"), index=True)
    route_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("routes.id", ondelete="CASCADE"), index=True
    )
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("people.id", ondelete="SET NULL"), index=True
    )
    hold: Mapped[int | None]
    colour: Mapped[str] = mapped_column(String(40), default="")
    kind: Mapped[str] = mapped_column(String(10))
    note: Mapped[str] = mapped_column(String(300), default="")
    done_at: Mapped[datetime | None]
