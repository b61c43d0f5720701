"""Anonymous counts of ascents and opinions by route."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.kinds import TOPS
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.climbing.points import crowd_grade
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.publishing.models import Route


@dataclass
class Tally:
    """Counts of one route.

    Parameters
    ----------
    ascents : kind to number; climbers : number of people who topped or flashed it.
    stars : mean, None without votes; grades : label to votes; wishes : wish to number.
    crowd : median grade vote, empty with too few votes (`crowd.ENOUGH`).
    """

    ascents: dict[str, int] = field(default_factory=dict)
    climbers: int = 0
    stars: float | None = None
    grades: dict[str, int] = field(default_factory=dict)
    wishes: dict[str, int] = field(default_factory=dict)
    crowd: str = ""


def tallies(session: Session, routes: Iterable[UUID]) -> dict[UUID, Tally]:
    """Return tallies by route, in the order of `routes`."""
    tallied = {route: Tally() for route in routes}
    _count_ascents(session, tallied)
    _count_opinions(session, tallied)
    _crowd_grade_of(session, {route: tally for route, tally in tallied.items() if tally.grades})
    return tallied


def _crowd_grade_of(session: Session, tallied: Mapping[UUID, Tally]) -> None:
    systems = select(Route.id, GradeSystem.grades).join(
        GradeSystem, GradeSystem.id == Route.grade_system_id
    )
    for route, grades in session.execute(systems.where(Route.id.in_(tallied))):
        labels = [grade["label"] for grade in grades]
        tallied[route].crowd = crowd_grade(tallied[route].grades, labels)


def _count_ascents(session: Session, tallied: Mapping[UUID, Tally]) -> None:
    """Count ascents from the index `ix_ascents_counts` alone."""
    route = Ascent.route_id
    counts = route.in_(tallied), Ascent.taken_back_at.is_(None)
    kinds = select(route, Ascent.kind, func.count()).where(*counts)
    for key, kind, number in session.execute(kinds.group_by(route, Ascent.kind)):
        if key is not None:
            tallied[key].ascents[kind] = number
    tops = select(route, func.count(Ascent.person_id.distinct())).where(
        *counts, Ascent.kind.in_(TOPS)
    )
    for key, number in session.execute(tops.group_by(route)):
        if key is not None:
            tallied[key].climbers = number


def _count_opinions(session: Session, tallied: Mapping[UUID, Tally]) -> None:
    of = Opinion.route_id, Opinion.grade, Opinion.stars, Opinion.wish
    votes = select(*of, func.count()).where(Opinion.route_id.in_(tallied)).group_by(*of)
    given: dict[UUID, Counter[int]] = defaultdict(Counter)
    for route, grade, stars, wish, number in session.execute(votes):
        tally = tallied[route]
        for vote, counted in ((grade, tally.grades), (wish, tally.wishes)):
            if vote:
                counted[vote] = counted.get(vote, 0) + number
        if stars is not None:
            given[route][stars] += number
    for route, counter in given.items():
        whole = sum(stars * number for stars, number in counter.items())
        tallied[route].stars = round(whole / counter.total(), 2)
