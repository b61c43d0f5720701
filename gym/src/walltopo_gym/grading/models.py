"""Tables of the grade model's difficulty estimates."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_climb.movement.reach import Reached
from walltopo_gym.clock import now
from walltopo_gym.database.base import Base


class ScanPlaces(Base):
    """A scan whose routes have estimates.

    `model` is the identity of the grade model: estimates of two models are not comparable. `learnt`
    has that model's error statistics (`walltopo_climb.grades.model.Learnt`). `shown` is the
    revision of the edits that the scan's files showed (`ScanEdits.shown`), 0 before any. `reach`:
    by a route's number, of each of `walltopo_climb.movement.reach.HEIGHTS` whether it reaches the
    top; null until computed.
    """

    __tablename__ = "scan_places"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    model: Mapped[str] = mapped_column(String(16))
    shown: Mapped[int]
    learnt: Mapped[dict[str, Any]] = mapped_column(JSON)
    reach: Mapped[dict[str, list[Reached]] | None] = mapped_column(JSON(none_as_null=True))
    at: Mapped[datetime] = mapped_column(default=now)


class PlacedRoute(Base):
    """The estimate of one route; a route that no adult can climb has no row.

    `place` is the model's estimate in steps of the Font scale; `known`: whether its hold types are
    known.
    """

    __tablename__ = "placed_routes"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scan_places.scan_id", ondelete="CASCADE"), primary_key=True
    )
    number: Mapped[int] = mapped_column(primary_key=True)
    place: Mapped[float]
    known: Mapped[bool]
