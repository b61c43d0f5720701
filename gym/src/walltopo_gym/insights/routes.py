"""What is known of each route that hangs, and of each setter."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.counting import zone_of
from walltopo_gym.climbing.crowd import crowd_grade
from walltopo_gym.climbing.models import Opinion
from walltopo_gym.climbing.styles import steepness_of
from walltopo_gym.climbing.visits import gym_day
from walltopo_gym.gyms.models import GradeSystem, Gym, Wall
from walltopo_gym.insights.shrinking import NOTHING, Sample, shrunk
from walltopo_gym.insights.usage import ENOUGH, Usage, climbers_of, usage
from walltopo_gym.publishing.models import Placement, Route

RECENT: Final = timedelta(days=28)


@dataclass(frozen=True)
class RouteFigures:
    """What may be told of a route that hangs.

    Parameters
    ----------
    steepness : of `styles.STEEPNESS`, empty where it is not known; age : in days.
    climbers : who topped it.
    flash_rate : of who topped it, how many flashed it, shrunk; None with fewer than `ENOUGH`.
    recent : ascents of the last 28 days; None where they, or older ones, are of few people.
    stars : mean, shrunk; votes : how many gave stars.
    crowd : the median of the grade votes, empty while they are few; grade_votes : how many.
    off : by how many steps of the grade system climbers find it harder, shrunk; None: no votes.
    keep, renew : wishes.
    """

    id: UUID
    wall_id: UUID
    number: int
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
    """The same, with all that is known of its use."""

    use: Usage


@dataclass(frozen=True)
class SetterInsight:
    """A setter, over all of their routes, those that hang no more too; as of a route, else.

    Parameters
    ----------
    hanging, routes : how many hang, how many there are.
    ascents, climbers : None where fewer than `ENOUGH` have topped one.
    """

    setter: str
    hanging: int
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
class Told:
    """All of it; `today` is the gym's."""

    today: date
    routes: list[OfRoute]
    setters: list[SetterInsight]


@dataclass
class _Said:
    """Opinions on one route: stars, steps that a voted grade stands above the setter's, wishes."""

    stars: Sample = NOTHING
    off: Sample = NOTHING
    keep: int = 0
    renew: int = 0
    crowd: str = ""


def of_routes(session: Session, gym: Gym, at: datetime) -> Told:
    """Of each route that hangs, wall by wall, and of each setter.

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
    said = _said(session, gym.id, graded)
    today = gym_day(at, zone_of(gym))
    of_setter = {row.id: row.setter for row in routes}
    hanging = {row.id for row in routes if row.stripped_at is None}
    setters = _setters(of_setter, hanging, used, said, climbers_of(session, gym.id))
    return Told(today, _hanging(session, gym.id, today, used, said), setters)


def _hanging(
    session: Session, gym: UUID, today: date, used: Mapping[UUID, Usage],
    said: Mapping[UUID, _Said],
) -> list[OfRoute]:  # fmt: skip
    placed = session.execute(
        select(Route, Placement.number, Placement.steepness_deg)
        .join(Placement, Placement.route_id == Route.id)
        .join(Wall, Wall.published_scan_id == Placement.scan_id)
        .where(Wall.gym_id == gym, Route.stripped_at.is_(None))
        .order_by(Wall.place, Wall.name, Placement.number)
    ).all()
    stars = shrunk({key: one.stars for key, one in said.items()})
    off = shrunk({key: one.off for key, one in said.items()})
    flashes = shrunk({key: Sample.of_shares(u.flashed, u.climbers) for key, u in used.items()})
    told = []
    for route, number, degrees in placed:
        use, opinion = used.get(route.id, Usage()), said.get(route.id, _Said())
        enough = use.climbers >= ENOUGH
        told.append(OfRoute(
            id=route.id, wall_id=route.wall_id, number=number, name=route.name,
            colour=route.colour, system=route.grade_system_id, grade=route.grade,
            setter=route.setter, steepness=steepness_of(degrees), set_on=route.set_on,
            strip_on=route.strip_on, age=max(0, (today - route.set_on).days), use=use,
            ascents=use.ascents, climbers=use.climbers, recent=use.told_recent,
            flash_rate=_rounded(flashes.get(route.id), 3) if enough else None,
            stars=_rounded(stars.get(route.id)), votes=opinion.stars.n, crowd=opinion.crowd,
            grade_votes=opinion.off.n, off=_rounded(off.get(route.id)), keep=opinion.keep,
            renew=opinion.renew,
        ))  # fmt: skip
    return told


def _setters(
    of_setter: Mapping[UUID, str], hanging: set[UUID], used: Mapping[UUID, Usage],
    said: Mapping[UUID, _Said], climbers: Mapping[str, int],
) -> list[SetterInsight]:  # fmt: skip
    routes: dict[str, list[UUID]] = defaultdict(list)
    for route, setter in of_setter.items():
        if setter:
            routes[setter].append(route)

    def summed(take: str) -> dict[str, Sample]:
        return {
            setter: sum((getattr(said[r], take) for r in mine if r in said), NOTHING)
            for setter, mine in routes.items()
        }

    stars, off = summed("stars"), summed("off")
    uses = {setter: [used[r] for r in mine if r in used] for setter, mine in routes.items()}
    flashes = {
        setter: Sample.of_shares(sum(u.flashed for u in mine), sum(u.climbers for u in mine))
        for setter, mine in uses.items()
    }
    shrunk_stars, shrunk_off, shrunk_flashes = shrunk(stars), shrunk(off), shrunk(flashes)
    found = []
    for setter, mine in sorted(routes.items()):
        enough = climbers.get(setter, 0) >= ENOUGH
        found.append(SetterInsight(
            setter=setter, hanging=len(hanging.intersection(mine)), routes=len(mine),
            ascents=sum(u.ascents for u in uses[setter]) if enough else None,
            climbers=climbers[setter] if enough else None,
            flash_rate=_rounded(shrunk_flashes.get(setter), 3) if enough else None,
            stars=_rounded(shrunk_stars.get(setter)), votes=stars[setter].n,
            off=_rounded(shrunk_off.get(setter)), grade_votes=off[setter].n,
            keep=sum(said[r].keep for r in mine if r in said),
            renew=sum(said[r].renew for r in mine if r in said),
        ))  # fmt: skip
    return found


def _said(
    session: Session, gym: UUID, graded: Mapping[UUID, tuple[UUID | None, str]]
) -> dict[UUID, _Said]:
    systems = select(GradeSystem.id, GradeSystem.grades).where(GradeSystem.gym_id == gym)
    labels: dict[UUID | None, list[str]] = {
        key: [str(grade["label"]) for grade in grades] for key, grades in session.execute(systems)
    }
    of = Opinion.route_id, Opinion.grade, Opinion.stars, Opinion.wish
    votes = (
        select(*of, func.count()).join(Route, Route.id == Opinion.route_id)
        .join(Wall, Wall.id == Route.wall_id).where(Wall.gym_id == gym).group_by(*of)
    )  # fmt: skip
    found: dict[UUID, _Said] = defaultdict(_Said)
    grades: dict[UUID, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for route, grade, stars, wish, number in session.execute(votes):
        one = found[route]
        if stars is not None:
            one.stars += Sample(number, number * stars, number * stars**2)
        one.keep += number if wish == "keep" else 0
        one.renew += number if wish == "renew" else 0
        if grade:
            grades[route][grade] += number
            steps = _steps(labels, *graded[route], grade)
            if steps is not None:
                one.off += Sample(number, number * steps, number * steps**2)
    for route, given in grades.items():
        system = graded[route][0]
        found[route].crowd = crowd_grade(given, labels.get(system, ()))
    return found


def _steps(
    labels: Mapping[UUID | None, Sequence[str]], system: UUID | None, grade: str, vote: str
) -> int | None:
    """How many steps above the route's grade a vote is; None where one is none of the system."""
    known = labels.get(system, ())
    return known.index(vote) - known.index(grade) if grade in known and vote in known else None


def _rounded(value: float | None, digits: int = 2) -> float | None:
    return None if value is None else round(value, digits)
