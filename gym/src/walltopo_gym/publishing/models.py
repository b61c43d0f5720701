"""Tables of routes, and of where they are in each version of a wall."""

from __future__ import annotations

from datetime import date, datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column, relationship

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.gyms.models import GRADE_BY, GRADE_ROWS
from walltopo_gym.walls.disciplines import Discipline, disciplines_on
from walltopo_gym.walls.models import RopeLine


class Route(Keyed, Base):
    """A route from setting to stripping, over any number of scans.

    `grade` is a label of the grade system; `stripped_at` is null while it is current. `by_hand`: a
    setter added it without a scan; until a scan places it, no publication strips it. `line_id`: the
    line on which it is climbed with a rope; null for a boulder.
    """

    __tablename__ = "routes"

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80), default="")
    colour: Mapped[str] = mapped_column(String(40), default="")
    grade_system_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("grade_systems.id", ondelete="SET NULL"), index=True
    )
    grade: Mapped[str] = mapped_column(String(80), default="", info={GRADE_BY: "grade_system_id"})
    setter: Mapped[str] = mapped_column(String(80), default="")
    tags: Mapped[list[str]] = mapped_column(JSON, default=list)
    set_on: Mapped[date]
    strip_on: Mapped[date | None]
    stripped_at: Mapped[datetime | None] = mapped_column(index=True)
    by_hand: Mapped[bool] = mapped_column(default=False)
    line_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("rope_lines.id", ondelete="SET NULL"), index=True
    )
    # Loaded by one statement for all routes of a result, and by none if they are boulders.
    line: Mapped[RopeLine | None] = relationship(lazy="selectin", viewonly=True)

    @property
    def disciplines(self) -> list[Discipline]:
        """The disciplines in which it is climbed, the usual one first."""
        return disciplines_on(None if self.line is None else self.line.belays)


class Placement(Base):
    """A route in one scan: its number there, the ids of its holds, and its style.

    `steepness_deg` is the mean angle of the wall under its holds, positive for overhangs; null in
    versions older than the column. `hold_types`: type to number of holds. `reach`: heights in
    metres, of `walltopo_climb.movement.reach`, that reach the top; null until computed, or if it is
    no climb (publishing/moves.py). `longest_reach`: in the order of `reach`, the longest distance
    in metres between both hands at once. `height_m`: of its highest above its lowest hold.
    `features`: those of the grade model (`walltopo_climb.grades.features`) for an adult, null where
    unknown. `as_was`: the route's facts on the day on which the next version replaced this one
    (publishing/versions.py); null in the current version.
    """

    __tablename__ = "placements"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    number: Mapped[int] = mapped_column(primary_key=True)
    route_id: Mapped[UUID] = mapped_column(ForeignKey("routes.id", ondelete="CASCADE"), index=True)
    holds: Mapped[list[int]] = mapped_column(JSON)
    steepness_deg: Mapped[float | None]
    hold_types: Mapped[dict[str, int]] = mapped_column(JSON, default=dict)
    reach: Mapped[list[float] | None] = mapped_column(JSON(none_as_null=True))
    longest_reach: Mapped[list[float] | None] = mapped_column(JSON(none_as_null=True))
    height_m: Mapped[float | None]
    features: Mapped[list[float | None] | None] = mapped_column(JSON(none_as_null=True))
    as_was: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))


class Plan(Base):
    """A planned publication; without `at` it waits for the other walls of the zone.

    `entries` and `found` are the confirmed table (`Placed.row` by number), `over_id` the version
    that was published then; `error`: why it failed.
    """

    __tablename__ = "plans"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    over_id: Mapped[UUID | None]
    made_by: Mapped[UUID | None] = mapped_column(ForeignKey("people.id", ondelete="SET NULL"))
    created_at: Mapped[datetime] = mapped_column(default=now)
    at: Mapped[datetime | None]
    entries: Mapped[list[dict[str, Any]]] = mapped_column(
        JSON, info={GRADE_ROWS: ("grade_system_id", "grade")}
    )
    found: Mapped[dict[str, dict[str, Any]]] = mapped_column(JSON)
    error: Mapped[str] = mapped_column(String(500), default="")
