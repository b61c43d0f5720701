"""What a gym tells of its own scale: its setters' grades, and its climbers' votes.

A route counts once, by where the model puts it in its last published scan. Of votes only those on
routes that enough people voted on: of fewer nobody is told the crowd's grade either. They count as
on the page of insights, drawn towards what all votes say (`insights/shrinking.py`).
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

from walltopo_climb.grades.calibrate import Known
from walltopo_climb.grades.font import grade_ends
from walltopo_gym.climbing.crowd import ENOUGH
from walltopo_gym.climbing.models import Opinion
from walltopo_gym.clock import now
from walltopo_gym.grading.models import PlacedRoute, ScanPlaces
from walltopo_gym.gyms.models import GradeSystem, Wall
from walltopo_gym.insights.shrinking import NOTHING, Sample, shrunk
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import State

# Routes that hang no more tell of the scale too; a gym's grades drift.
_REMEMBERED: Final = timedelta(days=365)
_COMMON: Final = ("font", "v")


class Span(NamedTuple):
    """First and last place on the Font scale that a gym's grade means."""

    low: int
    high: int

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    @property
    def width(self) -> int:
        return self.high - self.low


@dataclass(frozen=True)
class ToldRoute:
    """A route that tells of the gym's scale.

    Parameters
    ----------
    hangs : still. span : of its setter's grade; None where only climbers graded it.
    known : whether the types of its holds are. told : what the scale is learnt from.
    """

    id: UUID
    hangs: bool
    span: Span | None
    known: bool
    told: Known


@dataclass(frozen=True)
class _Votes:
    """On one route: how many, their mean place and width, and how far above the setter's grade."""

    number: int
    mean: float
    width: float
    off: Sample


def span_of(kind: str, grade: Mapping[str, Any]) -> Span | None:
    """What a grade of a system means; None for a gym's own label without a range.

    Parameters
    ----------
    kind : of the system. grade : a row of its `grades`.
    """
    if kind in _COMMON:
        ends = grade_ends(grade["label"])
        return None if ends is None else Span(*ends)
    first, last = (grade_ends(grade.get(name) or "") for name in ("low", "high"))
    return None if first is None or last is None else Span(first[0], last[1])


def told_routes(session: Session, gym: UUID, model: str) -> list[ToldRoute]:
    """The routes of a gym that have a grade on a common scale, or votes on one.

    Parameters
    ----------
    model : identity of the one that all places are of.
    """
    spans = _spans(session, gym)
    placed = _placed(session, gym, model)
    graded = {key: _span(spans, row.grade_system_id, row.grade) for key, row in placed.items()}
    votes = _votes(session, gym, spans, {
        key: (row.grade_system_id, graded[key]) for key, row in placed.items()
    })  # fmt: skip
    off = shrunk({key: one.off for key, one in votes.items()})
    told = []
    for key, row in placed.items():
        known = _known(row.place, graded[key], votes.get(key), off.get(key))
        if known is not None:
            hangs = row.stripped_at is None
            told.append(ToldRoute(key, hangs, graded[key], row.known, known))
    return told


def _known(
    place: float, span: Span | None, votes: _Votes | None, off: float | None
) -> Known | None:
    """Votes where there are enough, the setter's grade elsewhere."""
    if votes is None:
        return None if span is None else Known(place, span.middle, width=span.width)
    # Without a setter's grade there is nothing that they could be harder than.
    grade = votes.mean if span is None or off is None else span.middle + off
    return Known(place, grade, votes.number, votes.width)


def _spans(session: Session, gym: UUID) -> dict[UUID, dict[str, Span]]:
    """Of each system its grades that are on a common scale."""
    systems = select(GradeSystem).where(GradeSystem.gym_id == gym)
    return {
        system.id: {
            grade["label"]: span
            for grade in system.grades
            if (span := span_of(system.kind, grade)) is not None
        }
        for system in session.scalars(systems)
    }


def _span(spans: Mapping[UUID, Mapping[str, Span]], system: UUID | None, grade: str) -> Span | None:
    return spans.get(system, {}).get(grade) if system is not None else None


def _placed(session: Session, gym: UUID, model: str) -> dict[UUID, Any]:
    """Routes with a place, each by its last published scan."""
    rows = session.execute(
        select(Route.id, Route.grade_system_id, Route.grade, Route.stripped_at, PlacedRoute.place,
               PlacedRoute.known)
        .join(Wall, Wall.id == Route.wall_id)
        .join(Placement, Placement.route_id == Route.id)
        .join(Scan, Scan.id == Placement.scan_id)
        .join(ScanPlaces, ScanPlaces.scan_id == Scan.id)
        .join(PlacedRoute, and_(PlacedRoute.scan_id == Placement.scan_id,
                                PlacedRoute.number == Placement.number))
        .where(Wall.gym_id == gym, ScanPlaces.model == model)
        .where(Scan.state.in_((State.PUBLISHED, State.SUPERSEDED)))
        .where(or_(Route.stripped_at.is_(None), Route.stripped_at >= now() - _REMEMBERED))
        .order_by(Scan.published_at, Route.id)
    )  # fmt: skip
    return {row.id: row for row in rows}


def _votes(
    session: Session, gym: UUID, spans: Mapping[UUID, Mapping[str, Span]],
    graded: Mapping[UUID, tuple[UUID | None, Span | None]],
) -> dict[UUID, _Votes]:  # fmt: skip
    """Of the routes that enough people voted on."""
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
            span = _span(spans, graded[route][0], label)
            if span is not None:
                given[route].append((span, number))
    counted = {key: _counted(votes, graded[key][1]) for key, votes in given.items()}
    return {key: one for key, one in counted.items() if one.number >= ENOUGH}


def _counted(votes: Sequence[tuple[Span, int]], setter: Span | None) -> _Votes:
    number = sum(n for _, n in votes)
    off = NOTHING
    if setter is not None:
        for span, n in votes:
            steps = span.middle - setter.middle
            off += Sample(n, n * steps, n * steps**2)
    mean, width = (
        sum(value * n for value, n in values) / number
        for values in (
            [(span.middle, n) for span, n in votes], [(span.width, n) for span, n in votes]
        )
    )  # fmt: skip
    return _Votes(number, mean, width, off)
