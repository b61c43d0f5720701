"""Ranges of grades for the routes of a scan, and which graded routes lie outside of theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.scans.document import parse
from walltopo_climb.grades.calibrate import OWN_ERRORS
from walltopo_climb.grades.model import Learnt, Range
from walltopo_climb.grades.scale import GymScale
from walltopo_gym.editing.models import ScanEdits
from walltopo_gym.grading.models import PlacedRoute, ScanPlaces
from walltopo_gym.grading.told import Span, ToldRoute, told_routes
from walltopo_gym.gyms.models import Wall
from walltopo_gym.scans.models import Scan

Side = Literal["soft", "hard"]


@dataclass(frozen=True)
class Ranges:
    """Of the routes of a scan by number; those that no figure gets up have none.

    Parameters
    ----------
    graded : routes of the gym that they lean on; voted : those of them by climbers' votes.
    """

    graded: int
    voted: int
    coverage: float
    found: dict[int, Range]


@dataclass(frozen=True)
class Odd:
    """A route whose grade lies outside of its range.

    Parameters
    ----------
    side : "soft" where its grade is above, "hard" where it is below. by : steps of the Font scale.
    """

    route: UUID
    range: Range
    side: Side
    by: int


@dataclass(frozen=True)
class Odds:
    """The most odd ones first; none while fewer than `enough` routes are graded."""

    graded: int
    enough: int
    routes: list[Odd]


def ranges_of(session: Session, gym: UUID, scan: UUID) -> Ranges | None:
    """As if each of its routes were new; None while they are being worked out."""
    row = session.get(ScanPlaces, scan)
    edits = session.get(ScanEdits, scan)
    if row is None or row.shown != (0 if edits is None else edits.shown):
        return None
    told = told_routes(session, gym, row.model)
    scale = _scale(row, told)
    placed = session.scalars(select(PlacedRoute).where(PlacedRoute.scan_id == scan))
    return Ranges(
        graded=len(told),
        voted=sum(one.told.votes > 0 for one in told),
        coverage=scale.learnt.known.coverage,
        found={one.number: scale.range(one.place, one.known) for one in placed},
    )


def odd_routes(session: Session, gym: UUID) -> Odds:
    """Of the routes that hang, each against what the others say; a fifth is outside by chance."""
    newest = (
        select(ScanPlaces)
        .join(Scan, Scan.id == ScanPlaces.scan_id)
        .join(Wall, Wall.published_scan_id == Scan.id)
        .where(Wall.gym_id == gym)
        .order_by(ScanPlaces.at.desc())
    )
    row = session.scalars(newest.limit(1)).first()
    told = [] if row is None else told_routes(session, gym, row.model)
    if row is None or len(told) < OWN_ERRORS:
        return Odds(len(told), OWN_ERRORS, [])
    scale = _scale(row, told)
    found = [
        odd
        for number, one in enumerate(told)
        if one.hangs and one.span is not None
        and (odd := _odd(one.id, one.span, scale.range_by_others(number, one.known))) is not None
    ]  # fmt: skip
    return Odds(len(told), OWN_ERRORS, sorted(found, key=lambda odd: (-odd.by, str(odd.route))))


def _scale(row: ScanPlaces, told: Sequence[ToldRoute]) -> GymScale:
    learnt = parse(row.learnt, Learnt, "the places of a scan")
    return GymScale(learnt, tuple(one.told for one in told))


def _odd(route: UUID, span: Span, found: Range) -> Odd | None:
    if span.low > found.high:
        return Odd(route, found, "soft", span.low - found.high)
    if span.high < found.low:
        return Odd(route, found, "hard", found.low - span.high)
    return None
