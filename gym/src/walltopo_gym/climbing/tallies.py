"""What climbers did on the routes of a wall and think of them, counted; nobody is named."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.publishing.models import Placement, Route

__all__ = ["Tally", "tallies"]


@dataclass
class Tally:
    """Of one route.

    Parameters
    ----------
    ascents : kind to number; climbers : who topped or flashed it, each once.
    stars : mean, None where nobody gave any; grades : label to votes; wishes : wish to number.
    """

    ascents: dict[str, int] = field(default_factory=dict)
    climbers: int = 0
    stars: float | None = None
    grades: dict[str, int] = field(default_factory=dict)
    wishes: dict[str, int] = field(default_factory=dict)


def tallies(session: Session, scan: UUID | None) -> dict[UUID, Tally]:
    """Of all routes that hang in a version of a wall, by route."""
    placed = select(Placement.route_id).join(Route, Route.id == Placement.route_id)
    hanging = placed.where(Placement.scan_id == scan, Route.stripped_at.is_(None))
    told = {route: Tally() for route in session.scalars(hanging.order_by(Placement.number))}
    _count_ascents(session, told)
    _count_opinions(session, told)
    return told


def _count_ascents(session: Session, told: Mapping[UUID, Tally]) -> None:
    """Answered from the index `ix_ascents_counts` alone."""
    route = Ascent.route_id
    counts = route.in_(told), Ascent.taken_back_at.is_(None)
    kinds = select(route, Ascent.kind, func.count()).where(*counts)
    for key, kind, number in session.execute(kinds.group_by(route, Ascent.kind)):
        if key is not None:
            told[key].ascents[kind] = number
    tops = select(route, func.count(Ascent.person_id.distinct())).where(
        *counts, Ascent.kind.in_(("flash", "top"))
    )
    for key, number in session.execute(tops.group_by(route)):
        if key is not None:
            told[key].climbers = number


def _count_opinions(session: Session, told: Mapping[UUID, Tally]) -> None:
    of = Opinion.route_id, Opinion.grade, Opinion.stars, Opinion.wish
    votes = select(*of, func.count()).where(Opinion.route_id.in_(told)).group_by(*of)
    given: dict[UUID, Counter[int]] = defaultdict(Counter)
    for route, grade, stars, wish, number in session.execute(votes):
        tally = told[route]
        for vote, counted in ((grade, tally.grades), (wish, tally.wishes)):
            if vote:
                counted[vote] = counted.get(vote, 0) + number
        if stars is not None:
            given[route][stars] += number
    for route, counter in given.items():
        whole = sum(stars * number for stars, number in counter.items())
        told[route].stars = round(whole / counter.total(), 2)
