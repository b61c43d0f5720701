"""The changes of each reset: each version of a wall against the one before it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise
from typing import Final
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.climbing.shrinking import Sample
from walltopo_gym.insights.usage import count_if_safe, what_counts
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.versions import routes_as_they_were, versions_of
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.models import Wall

_WEEK: Final = timedelta(days=7)
_WEEKS: Final = 4


@dataclass(frozen=True)
class Side:
    """A version of a wall, before or after a reset.

    Parameters
    ----------
    grades : label to number of routes, as they were graded then.
    ascents : on this wall, in the weeks before or after; None if they are of few people.
    stars : mean stars of the routes that went or came; None with fewer than three votes.
    """

    scan_id: UUID
    published_at: datetime
    routes: int
    grades: dict[str, int]
    ascents: int | None
    stars: float | None
    votes: int


@dataclass(frozen=True)
class Reset:
    """Numbers of routes that stayed, came and went. `weeks` before and after it are compared: at
    most four whole weeks, none beyond the next version or the present."""

    wall_id: UUID
    weeks: int
    stayed: int
    came: int
    went: int
    before: Side
    after: Side


def resets_of(session: Session, wall: Wall, at: datetime) -> list[Reset]:
    """Return the resets of a wall, the latest first.

    Parameters
    ----------
    at : now.
    """
    versions = [scan for scan in versions_of(session, wall.id) if scan.published_at is not None]
    ends = [scan.published_at for scan in versions[2:]] + [at]
    found = [
        _reset(session, wall, before, after, end or at)
        for (before, after), end in zip(pairwise(versions), ends, strict=False)
    ]
    return found[::-1]


def _reset(session: Session, wall: Wall, before: Scan, after: Scan, end: datetime) -> Reset:
    begun, moment = before.published_at, after.published_at
    assert begun is not None
    assert moment is not None
    weeks = max(0, min(_WEEKS, (end - moment) // _WEEK, (moment - begun) // _WEEK))
    old = {route.id: facts["grade"] for _, route, facts in routes_as_they_were(session, before.id)}
    new = {route.id: facts["grade"] for _, route, facts in routes_as_they_were(session, after.id)}
    span = weeks * _WEEK
    return Reset(
        wall_id=wall.id,
        weeks=weeks,
        stayed=len(old.keys() & new.keys()),
        came=len(new.keys() - old.keys()),
        went=len(old.keys() - new.keys()),
        before=_side(session, wall, before, old, (moment - span, moment), old.keys() - new.keys()),
        after=_side(session, wall, after, new, (moment, moment + span), new.keys() - old.keys()),
    )


def _side(
    session: Session,
    wall: Wall,
    scan: Scan,
    grades: dict[UUID, str],
    span: tuple[datetime, datetime],
    changed: Iterable[UUID],
) -> Side:
    climbed = (
        select(func.count(), func.count(Ascent.person_id.distinct()))
        .join(Route, Route.id == Ascent.route_id)
        .where(
            what_counts(wall.gym_id),
            Route.wall_id == wall.id,
            Ascent.climbed_at >= span[0],
            Ascent.climbed_at < span[1],
        )
    )
    ascents, people = session.execute(climbed).one()
    given = session.scalars(
        select(Opinion.stars).where(Opinion.route_id.in_(list(changed)), Opinion.stars.is_not(None))
    ).all()
    stars = [value for value in given if value is not None]
    mean = Sample(len(stars), sum(stars), 0.0).mean if len(stars) >= 3 else None
    assert scan.published_at is not None
    return Side(
        scan_id=scan.id,
        published_at=scan.published_at,
        routes=len(grades),
        grades=dict(Counter(grades.values())),
        ascents=count_if_safe(ascents, people),
        stars=None if mean is None else round(mean, 2),
        votes=len(stars),
    )
