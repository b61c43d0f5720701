"""Anonymous usage of each route of a gym, summed by the database."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import ColumnElement, and_, case, func, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.kinds import FIRST_TRIES, TOPS
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.insights.models import Washing
from walltopo_gym.publishing.models import Route

# Groups of fewer people are not broken down.
ENOUGH: Final = 5


@dataclass(frozen=True)
class Usage:
    """Usage of one route; projects do not count, because they are not tries.

    Parameters
    ----------
    ascents : flashes, tops, zones and tries; climbers : number of people who topped it; tried :
        number of people with one of these ascents; flashed : number of people who flashed it.
    tries : of all ascents.
    recent : ascents since a moment; recent_people, earlier_people : people with one since then,
        before.
    worn : tries since the wall was last washed.
    """

    ascents: int = 0
    climbers: int = 0
    tried: int = 0
    flashed: int = 0
    tries: int = 0
    recent: int = 0
    recent_people: int = 0
    earlier_people: int = 0
    worn: int = 0

    @property
    def recent_shown(self) -> int | None:
        """Return `recent`, or None if it or the rest is of few people."""
        return count_if_safe(self.recent, self.recent_people, self.earlier_people)


def count_if_safe(value: int, *people: int) -> int | None:
    """Return a value if its group and the rest are each of nobody or of at least `ENOUGH` people;
    else None."""
    return value if all(n == 0 or n >= ENOUGH for n in people) else None


def usage(session: Session, gym: UUID, since: datetime) -> dict[UUID, Usage]:
    """Return the usage of each route that was tried, current or not.

    Parameters
    ----------
    since : from when on an ascent is recent.
    """
    washed = last_washed()
    pairs = (
        select(
            Ascent.route_id,
            func.count().label("ascents"),
            func.sum(Ascent.tries).label("tries"),
            _any_row(Ascent.kind.in_(TOPS)).label("topped"),
            _any_row(Ascent.kind.in_(FIRST_TRIES)).label("flashed"),
            _count_rows(Ascent.climbed_at >= since).label("recent"),
            func.sum(case((_after_washing(washed), Ascent.tries), else_=0)).label("worn"),
        )
        .join(Route, Route.id == Ascent.route_id)
        .join(washed, washed.c.wall_id == Route.wall_id, isouter=True)
        .where(what_counts(gym))
        .group_by(Ascent.route_id, Ascent.person_id)
        .subquery()
    )
    of = pairs.c
    sums = select(
        of.route_id,
        func.sum(of.ascents),
        func.sum(of.topped),
        func.count(),
        func.sum(of.flashed),
        func.sum(of.tries),
        func.sum(of.recent),
        _count_rows(of.recent > 0),
        _count_rows(of.recent < of.ascents),
        func.sum(of.worn),
    ).group_by(of.route_id)
    return {
        route: Usage(*(int(value) for value in values)) for route, *values in session.execute(sums)
    }


def climbers_of(session: Session, gym: UUID) -> dict[str, int]:
    """Return the number of people who topped a route of each setter."""
    people = (
        select(Route.setter, func.count(Ascent.person_id.distinct()))
        .join(Route, Route.id == Ascent.route_id)
        .where(what_counts(gym), Ascent.kind.in_(TOPS))
        .group_by(Route.setter)
    )
    return dict(session.execute(people).all())


def worn_walls(session: Session, gym: UUID) -> dict[UUID, int | None]:
    """Return tries on the current routes of each wall since it was last washed; None if they, or
    those before, are of few people."""
    washed = last_washed()
    of = (
        select(
            Route.wall_id,
            func.sum(case((_after_washing(washed), Ascent.tries), else_=0)).label("tries"),
            _any_row(_after_washing(washed)).label("since"),
            _any_row(~_after_washing(washed)).label("before"),
        )
        .join(Route, Route.id == Ascent.route_id)
        .join(washed, washed.c.wall_id == Route.wall_id, isouter=True)
        .where(what_counts(gym), Route.stripped_at.is_(None))
        .group_by(Route.wall_id, Ascent.person_id)
        .subquery()
    ).c
    sums = select(of.wall_id, func.sum(of.tries), func.sum(of.since), func.sum(of.before))
    return {
        wall: count_if_safe(int(tries), int(since), int(before))
        for wall, tries, since, before in session.execute(sums.group_by(of.wall_id))
    }


def _after_washing(washed: Any) -> ColumnElement[bool]:
    return or_(washed.c.at.is_(None), Ascent.climbed_at >= washed.c.at)


def last_washed() -> Any:
    """Return the last washing of each wall (`wall_id`, `at`) as a subquery."""
    return (
        select(Washing.wall_id, func.max(Washing.washed_at).label("at"))
        .group_by(Washing.wall_id)
        .subquery()
    )


def what_counts(gym: UUID) -> ColumnElement[bool]:
    """Return the condition of ascents that count into sums."""
    return and_(
        Ascent.gym_id == gym,
        Ascent.taken_back_at.is_(None),
        Ascent.kind != "project",
        Ascent.route_id.is_not(None),
    )


def _any_row(condition: ColumnElement[bool]) -> ColumnElement[int]:
    """Return an aggregate: 1 if the condition holds for any row of the group."""
    return func.max(case((condition, 1), else_=0))


def _count_rows(condition: ColumnElement[bool]) -> ColumnElement[int]:
    return func.sum(case((condition, 1), else_=0))
