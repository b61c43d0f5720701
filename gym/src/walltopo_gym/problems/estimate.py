"""Estimate a problem by the movement model: a range of grades, and the heights that reach it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo.scans.routes import Route
from walltopo_climb.grades.model import Range, shipped_identity, shipped_model
from walltopo_climb.grades.of_scan import place_routes
from walltopo_climb.movement.reach import HEIGHTS, reaching_heights
from walltopo_gym.grading.service import range_of
from walltopo_gym.problems.service import Use, UsedHold
from walltopo_gym.publishing.version_holds import VersionHolds


@dataclass(frozen=True)
class Estimate:
    """An estimate of a problem.

    Parameters
    ----------
    grades : None if the model finds no moves for an adult, or knows no grades of this wall.
    heights : height in metres and whether a climber of that height reaches the top.
    """

    grades: Range | None
    heights: list[tuple[float, bool]]


def estimate(
    session: Session, gym: UUID, scan: UUID, version: VersionHolds, used: Sequence[UsedHold]
) -> Estimate:
    """Return what the model says of a problem on a published version."""
    route = _route(used, version)
    holds, unit = list(version.by_id.values()), version.unit
    placed = place_routes([route], holds, unit, shipped_model())
    grades = None
    if placed:
        [one] = placed
        grades = range_of(session, gym, scan, shipped_identity(), one.place, known=one.known)
    reaching = reaching_heights(route, holds, unit) or ()
    return Estimate(grades, [(height, height in reaching) for height in HEIGHTS])


def _route(used: Sequence[UsedHold], version: VersionHolds) -> Route:
    def of(use: Use) -> tuple[int, ...]:
        return tuple(each.hold for each in used if each.use == use)

    upwards = sorted((each.hold for each in used), key=lambda hold: version.by_id[hold].position[2])
    return Route(
        id=1, holds=tuple(upwards), start=of(Use.START), top=of(Use.TOP), footholds=of(Use.FOOT)
    )
