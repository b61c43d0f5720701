"""Figures of each current route, and of each setter."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Opinion
from walltopo_gym.climbing.points import crowd_grade
from walltopo_gym.climbing.shrinking import NOTHING, Sample, shrunk_means
from walltopo_gym.climbing.styles import steepness_of
from walltopo_gym.gyms.days import gym_day, zone_of
from walltopo_gym.gyms.models import GradeSystem, Gym
from walltopo_gym.insights.usage import ENOUGH, Usage, climbers_of, usage
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.walls.models import Wall

RECENT: Final = timedelta(days=28)


@dataclass(frozen=True)
class RouteFigures:
    """Publishable figures of a current route.

    Parameters
    ----------
    number : None while no scan places it. steepness : of `styles.STEEPNESS`, empty if unknown.
    age : in days.
    climbers : number of people who topped it.
    flash_rate : share of its climbers who flashed it, shrunk; None with fewer than `ENOUGH`.
    recent : ascents of the last 28 days; None if they, or older ones, are of few people.
    stars : mean, shrunk; votes : number of star votes.
    crowd : median of the grade votes, empty with too few; grade_votes : their number.
    off : steps by which climbers find it harder than its grade, shrunk; None: no votes.
    keep, renew : numbers of votes for keeping and renewing it.
    """

    id: UUID
    wall_id: UUID
    number: int | None
    name: str
    colour: str
    system: UUID | None
    grade: str
    setter: str
    steepness: str
    set_on: date
    strip_on: date | None
    age: int
    ascents: int
    climbers: int
    recent: int | None
    flash_rate: float | None
    stars: float | None
    votes: int
    crowd: str
    grade_votes: int
    off: float | None
    keep: int
    renew: int


@dataclass(frozen=True)
class OfRoute(RouteFigures):
    """Figures of a route, with its unpublished usage."""

    use: Usage


@dataclass(frozen=True)
class SetterInsight:
    """A setter, over all of their routes, former ones included; fields as of a route.

    Parameters
    ----------
    current, routes : number of current routes, and of all.
    ascents, climbers : None if fewer than `ENOUGH` people topped one.
    """

    setter: str
    current: int
    routes: int
    ascents: int | None
    climbers: int | None
    flash_rate: float | None
    stars: float | None
    votes: int
    off: float | None
    grade_votes: int
    keep: int
    renew: int


@dataclass(frozen=True)
class RoutesInsight:
    """Figures of all routes and setters; `today` is the gym's day."""

    today: date
    routes: list[OfRoute]
    setters: list[SetterInsight]


@dataclass
class _Votes:
    """Opinions on one route: stars, steps of grade votes above the setter's grade, keep and
    renew."""

    stars: Sample = NOTHING
    off: Sample = NOTHING
    keep: int = 0
    renew: int = 0
    crowd: str = ""


def routes_insight(session: Session, gym: Gym, at: datetime) -> RoutesInsight:
    """Return the figures of each current route, by wall, and of each setter.

    Parameters
    ----------
    at : now.
    """
    routes = session.execute(
        select(Route.id, Route.setter, Route.grade_system_id, Route.grade, Route.stripped_at)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym.id)
    ).all()
    used = usage(session, gym.id, at - RECENT)
    graded = {row.id: (row.grade_system_id, row.grade) for row in routes}
    opinions = _votes(session, gym.id, graded)
    today = gym_day(at, zone_of(gym))
    of_setter = {row.id: row.setter for row in routes}
    current = {row.id for row in routes if row.stripped_at is None}
    setters = _setters(of_setter, current, used, opinions, climbers_of(session, gym.id))
    return RoutesInsight(today, _current_routes(session, gym.id, today, used, opinions), setters)


def _current_routes(
    session: Session,
    gym: UUID,
    today: date,
    used: Mapping[UUID, Usage],
    opinions: Mapping[UUID, _Votes],
) -> list[OfRoute]:
    placed = [
        (route, None, None) if found is None else (route, found.number, found.steepness_deg)
        for route, found in gym_routes(session, gym)
    ]
    stars = shrunk_means({key: one.stars for key, one in opinions.items()})
    off = shrunk_means({key: one.off for key, one in opinions.items()})
    flashes = shrunk_means(
        {key: Sample.of_shares(u.flashed, u.climbers) for key, u in used.items()}
    )
    listed = []
    for route, number, degrees in placed:
        use, opinion = used.get(route.id, Usage()), opinions.get(route.id, _Votes())
        enough = use.climbers >= ENOUGH
        listed.append(
            OfRoute(
                id=route.id,
                wall_id=route.wall_id,
                number=number,
                name=route.name,
                colour=route.colour,
                system=route.grade_system_id,
                grade=route.grade,
                setter=route.setter,
                steepness=steepness_of(degrees),
                set_on=route.set_on,
                strip_on=route.strip_on,
                age=max(0, (today - route.set_on).days),
                use=use,
                ascents=use.ascents,
                climbers=use.climbers,
                recent=use.recent_shown,
                flash_rate=_rounded(flashes.get(route.id), 3) if enough else None,
                stars=_rounded(stars.get(route.id)),
                votes=opinion.stars.n,
                crowd=opinion.crowd,
                grade_votes=opinion.off.n,
                off=_rounded(off.get(route.id)),
                keep=opinion.keep,
                renew=opinion.renew,
            )
        )
    return listed


def _setters(
    of_setter: Mapping[UUID, str],
    current: set[UUID],
    used: Mapping[UUID, Usage],
    opinions: Mapping[UUID, _Votes],
    climbers: Mapping[str, int],
) -> list[SetterInsight]:
    routes: dict[str, list[UUID]] = defaultdict(list)
    for route, setter in of_setter.items():
        if setter:
            routes[setter].append(route)

    def summed(take: str) -> dict[str, Sample]:
        return {
            setter: sum((getattr(opinions[r], take) for r in mine if r in opinions), NOTHING)
            for setter, mine in routes.items()
        }

    stars, off = summed("stars"), summed("off")
    uses = {setter: [used[r] for r in mine if r in used] for setter, mine in routes.items()}
    flashes = {
        setter: Sample.of_shares(sum(u.flashed for u in mine), sum(u.climbers for u in mine))
        for setter, mine in uses.items()
    }
    shrunk_stars, shrunk_off, shrunk_flashes = (
        shrunk_means(stars),
        shrunk_means(off),
        shrunk_means(flashes),
    )
    found = []
    for setter, mine in sorted(routes.items()):
        enough = climbers.get(setter, 0) >= ENOUGH
        found.append(
            SetterInsight(
                setter=setter,
                current=len(current.intersection(mine)),
                routes=len(mine),
                ascents=sum(u.ascents for u in uses[setter]) if enough else None,
                climbers=climbers[setter] if enough else None,
                flash_rate=_rounded(shrunk_flashes.get(setter), 3) if enough else None,
                stars=_rounded(shrunk_stars.get(setter)),
                votes=stars[setter].n,
                off=_rounded(shrunk_off.get(setter)),
                grade_votes=off[setter].n,
                keep=sum(opinions[r].keep for r in mine if r in opinions),
                renew=sum(opinions[r].renew for r in mine if r in opinions),
            )
        )
    return found


def _votes(
    session: Session, gym: UUID, graded: Mapping[UUID, tuple[UUID | None, str]]
) -> dict[UUID, _Votes]:
    systems = select(GradeSystem.id, GradeSystem.grades).where(GradeSystem.gym_id == gym)
    labels: dict[UUID | None, list[str]] = {
        key: [str(grade["label"]) for grade in grades] for key, grades in session.execute(systems)
    }
    of = Opinion.route_id, Opinion.grade, Opinion.stars, Opinion.wish
    votes = (
        select(*of, func.count())
        .join(Route, Route.id == Opinion.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym)
        .group_by(*of)
    )
    found: dict[UUID, _Votes] = defaultdict(_Votes)
    grades: dict[UUID, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for route, grade, stars, wish, number in session.execute(votes):
        one = found[route]
        if stars is not None:
            one.stars += Sample(number, number * stars, number * stars**2)
        one.keep += number if wish == "keep" else 0
        one.renew += number if wish == "renew" else 0
        if grade:
            grades[route][grade] += number
            steps = _steps_above_grade(labels, *graded[route], grade)
            if steps is not None:
                one.off += Sample(number, number * steps, number * steps**2)
    for route, given in grades.items():
        system = graded[route][0]
        found[route].crowd = crowd_grade(given, labels.get(system, ()))
    return found


def _steps_above_grade(
    labels: Mapping[UUID | None, Sequence[str]], system: UUID | None, grade: str, vote: str
) -> int | None:
    """Return a vote's steps above the route's grade; None for a grade outside the system."""
    known = labels.get(system, ())
    return known.index(vote) - known.index(grade) if grade in known and vote in known else None


def _rounded(value: float | None, digits: int = 2) -> float | None:
    return None if value is None else round(value, digits)
