"""Grade ranges of a scan's routes, from the model, the setters' grades and the votes.

A route counts once, by the estimate of its last published scan. Votes count on routes that enough
people voted on, because the crowd's grade of others is not published either. As on the page of
insights, votes are drawn towards the mean of all votes (`climbing/shrinking.py`).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Final, NamedTuple
from uuid import UUID

from sqlalchemy import and_, func, or_, select
from sqlalchemy.orm import Session

from walltopo.scans.document import parse
from walltopo_climb.grades.calibrate import OWN_ERRORS, Known
from walltopo_climb.grades.font import grade_ends
from walltopo_climb.grades.model import Learnt, Range
from walltopo_climb.grades.scale import GymScale
from walltopo_climb.movement.reach import Reached
from walltopo_gym.climbing.models import Opinion
from walltopo_gym.climbing.points import ENOUGH
from walltopo_gym.climbing.shrinking import NOTHING, Sample, shrunk_means
from walltopo_gym.clock import now
from walltopo_gym.events import GradeOutlier, GradeOutliers, GradeOutliersOf, GradeRangeOf
from walltopo_gym.grading.models import PlacedRoute, ScanPlaces
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.scans.service import State
from walltopo_gym.walls.models import Wall

# Routes that hang no more tell of the scale too; a gym's grades drift.
_REMEMBERED: Final = timedelta(days=365)

_COMMON: Final = ("font", "v")


class Span(NamedTuple):
    """The first and last step of the Font scale that a gym's grade covers."""

    low: int
    high: int

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    @property
    def width(self) -> int:
        return self.high - self.low


@dataclass(frozen=True)
class ScaleRoute:
    """A graded route, for the gym's scale.

    Parameters
    ----------
    is_current : not stripped. span : of its setter's grade; None if only climbers graded it.
    known : whether its hold types are known. known_grade : for the scale.
    """

    id: UUID
    is_current: bool
    span: Span | None
    known: bool
    known_grade: Known


@dataclass(frozen=True)
class _Votes:
    """The votes on a route: number, mean and width on the Font scale, and the mean difference from
    the setter's grade."""

    number: int
    mean: float
    width: float
    off: Sample


def span_of(kind: str, grade: Mapping[str, Any]) -> Span | None:
    """Return the span of a grade; None for a gym's own label without a range.

    Parameters
    ----------
    kind : of the system. grade : a row of its `grades`.
    """
    if kind in _COMMON:
        ends = grade_ends(grade["label"])
        return None if ends is None else Span(*ends)
    first, last = (grade_ends(grade.get(name) or "") for name in ("low", "high"))
    return None if first is None or last is None else Span(first[0], last[1])


def scale_routes(session: Session, gym: UUID, model: str) -> list[ScaleRoute]:
    """Return the routes of a gym that have a grade on a common scale, or votes on one.

    Parameters
    ----------
    model : identity of the model of all estimates.
    """
    spans = _spans_by_system(session, gym)
    placed = _estimated_routes(session, gym, model)
    graded = {
        key: _span_of_grade(spans, row.grade_system_id, row.grade) for key, row in placed.items()
    }
    votes = _voted_routes(
        session,
        gym,
        spans,
        {key: (row.grade_system_id, graded[key]) for key, row in placed.items()},
    )
    off = shrunk_means({key: one.off for key, one in votes.items()})
    scaled = []
    for key, row in placed.items():
        known = _known_grade(row.place, graded[key], votes.get(key), off.get(key))
        if known is not None:
            is_current = row.stripped_at is None
            scaled.append(ScaleRoute(key, is_current, graded[key], row.known, known))
    return scaled


def _known_grade(
    difficulty: float, span: Span | None, votes: _Votes | None, off: float | None
) -> Known | None:
    """Return the votes' grade with enough votes, else the setter's grade."""
    if votes is None:
        return None if span is None else Known(difficulty, span.middle, width=span.width)
    # Without a setter's grade there is nothing that they could be harder than.
    grade = votes.mean if span is None or off is None else span.middle + off
    return Known(difficulty, grade, votes.number, votes.width)


def _spans_by_system(session: Session, gym: UUID) -> dict[UUID, dict[str, Span]]:
    """Return the spans of each system's grades that are on a common scale."""
    systems = select(GradeSystem).where(GradeSystem.gym_id == gym)
    return {
        system.id: {
            grade["label"]: span
            for grade in system.grades
            if (span := span_of(system.kind, grade)) is not None
        }
        for system in session.scalars(systems)
    }


def _span_of_grade(
    spans: Mapping[UUID, Mapping[str, Span]], system: UUID | None, grade: str
) -> Span | None:
    return spans.get(system, {}).get(grade) if system is not None else None


def _estimated_routes(session: Session, gym: UUID, model: str) -> dict[UUID, Any]:
    """Return routes with an estimate, each by its last published scan."""
    rows = session.execute(
        select(
            Route.id,
            Route.grade_system_id,
            Route.grade,
            Route.stripped_at,
            PlacedRoute.place,
            PlacedRoute.known,
        )
        .join(Wall, Wall.id == Route.wall_id)
        .join(Placement, Placement.route_id == Route.id)
        .join(Scan, Scan.id == Placement.scan_id)
        .join(ScanPlaces, ScanPlaces.scan_id == Scan.id)
        .join(
            PlacedRoute,
            and_(PlacedRoute.scan_id == Placement.scan_id, PlacedRoute.number == Placement.number),
        )
        .where(Wall.gym_id == gym, ScanPlaces.model == model)
        .where(Scan.state.in_((State.PUBLISHED, State.SUPERSEDED)))
        .where(or_(Route.stripped_at.is_(None), Route.stripped_at >= now() - _REMEMBERED))
        .order_by(Scan.published_at, Route.id)
    )
    return {row.id: row for row in rows}


def _voted_routes(
    session: Session,
    gym: UUID,
    spans: Mapping[UUID, Mapping[str, Span]],
    graded: Mapping[UUID, tuple[UUID | None, Span | None]],
) -> dict[UUID, _Votes]:
    """Return the votes of routes that enough people voted on."""
    rows = session.execute(
        select(Opinion.route_id, Opinion.grade, func.count())
        .join(Route, Route.id == Opinion.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym, Opinion.grade != "")
        .group_by(Opinion.route_id, Opinion.grade)
    )
    given: dict[UUID, list[tuple[Span, int]]] = defaultdict(list)
    for route, label, number in rows:
        if route in graded:
            span = _span_of_grade(spans, graded[route][0], label)
            if span is not None:
                given[route].append((span, number))
    counted = {key: _count_votes(votes, graded[key][1]) for key, votes in given.items()}
    return {key: one for key, one in counted.items() if one.number >= ENOUGH}


def _count_votes(votes: Sequence[tuple[Span, int]], setter: Span | None) -> _Votes:
    number = sum(n for _, n in votes)
    off = NOTHING
    if setter is not None:
        for span, n in votes:
            steps = span.middle - setter.middle
            off += Sample(n, n * steps, n * steps**2)
    mean, width = (
        sum(value * n for value, n in values) / number
        for values in (
            [(span.middle, n) for span, n in votes],
            [(span.width, n) for span, n in votes],
        )
    )
    return _Votes(number, mean, width, off)


@dataclass(frozen=True)
class Ranges:
    """Ranges of a scan's routes by number, without routes that nobody can climb.

    Parameters
    ----------
    graded : number of the gym's routes that they are based on; voted : those by climbers' votes.
    """

    graded: int
    voted: int
    coverage: float
    found: dict[int, Range]


def ranges_of(session: Session, gym: UUID, scan: UUID) -> Ranges | None:
    """Return the ranges as if each route were new; None while they are computed."""
    row = _estimates_of(session, scan)
    if row is None:
        return None
    graded_routes = scale_routes(session, gym, row.model)
    scale = _gym_scale(row, graded_routes)
    placed = session.scalars(select(PlacedRoute).where(PlacedRoute.scan_id == scan))
    return Ranges(
        graded=len(graded_routes),
        voted=sum(one.known_grade.votes > 0 for one in graded_routes),
        coverage=scale.learnt.known.coverage,
        found={one.number: scale.range(one.place, one.known) for one in placed},
    )


def reach_of(session: Session, scan: UUID) -> dict[str, list[Reached]] | None:
    """Return which heights reach the top of each route, by number; None while it is computed."""
    row = _estimates_of(session, scan)
    return None if row is None else row.reach


def _estimates_of(session: Session, scan: UUID) -> ScanPlaces | None:
    """Return the estimates of a scan; None if it has none, or was edited since."""
    row = session.get(ScanPlaces, scan)
    edits = session.get(ScanEdits, scan)
    shown = 0 if edits is None else edits.shown
    return row if row is not None and row.shown == shown else None


def answer_range(session: Session, question: GradeRangeOf) -> None:
    """Answer as if the climb were new to the gym, if the scan's own routes have estimates of the
    same model."""
    row = session.get(ScanPlaces, question.scan)
    if row is not None and row.model == question.model:
        scale = _gym_scale(row, scale_routes(session, question.gym, question.model))
        question.found.append(scale.range(question.place, question.known))


def answer_outliers(session: Session, question: GradeOutliersOf) -> None:
    """Answer with `grade_outliers`."""
    question.found.append(grade_outliers(session, question.gym))


def grade_outliers(session: Session, gym: UUID) -> GradeOutliers:
    """Compare each current route with the range from all others; a fifth is outside by chance."""
    newest = (
        select(ScanPlaces)
        .join(Scan, Scan.id == ScanPlaces.scan_id)
        .join(Wall, Wall.published_scan_id == Scan.id)
        .where(Wall.gym_id == gym)
        .order_by(ScanPlaces.at.desc())
    )
    row = session.scalars(newest.limit(1)).first()
    graded_routes = [] if row is None else scale_routes(session, gym, row.model)
    if row is None or len(graded_routes) < OWN_ERRORS:
        return GradeOutliers(len(graded_routes), OWN_ERRORS, [])
    scale = _gym_scale(row, graded_routes)
    found = [
        outlier
        for number, one in enumerate(graded_routes)
        if one.is_current
        and one.span is not None
        and (outlier := _outlier_row(one.id, one.span, scale.range_by_others(number, one.known)))
    ]
    return GradeOutliers(
        len(graded_routes),
        OWN_ERRORS,
        sorted(found, key=lambda outlier: (-outlier.by, str(outlier.route))),
    )


def _gym_scale(row: ScanPlaces, graded_routes: Sequence[ScaleRoute]) -> GymScale:
    learnt = parse(row.learnt, Learnt, "the places of a scan")
    return GymScale(learnt, tuple(one.known_grade for one in graded_routes))


def _outlier_row(route: UUID, span: Span, found: Range) -> GradeOutlier | None:
    if span.low > found.high:
        return GradeOutlier(route, found, "soft", span.low - found.high)
    if span.high < found.low:
        return GradeOutlier(route, found, "hard", found.low - span.high)
    return None
