"""A climber's progress in a gym, computed per request from ascents and sessions, which are few."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date, datetime, timedelta
from typing import Final, NamedTuple
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.kinds import FIRST_TRIES, TOPS
from walltopo_gym.climbing.models import Ascent, ClimbingSession
from walltopo_gym.climbing.styles import STEEPNESS, main_hold, steepness_of
from walltopo_gym.gyms.days import gym_day, zone_of
from walltopo_gym.gyms.models import GradeSystem, Gym
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.disciplines import Discipline, counted_as, disciplines_on
from walltopo_gym.walls.lookup import disciplines_of
from walltopo_gym.walls.models import RopeLine, Wall

_WEEK: Final = timedelta(days=7)
_WEEKS: Final = 53
_AT_ONCE: Final = 500  # a statement has a limited number of parameters


class _Done(NamedTuple):
    """The queried fields of an ascent."""

    route: UUID | None
    kind: str
    tries: int
    grade: str
    worth: int | None
    at: datetime


@dataclass
class OfGrade:
    """Numbers of topped and flashed routes of one grade."""

    grade: str
    worth: int
    routes: int = 0
    flashes: int = 0


@dataclass
class Month:
    """Counts of a month ("2026-03"); `hardest` is the label of its hardest top."""

    month: str
    hardest: str = ""
    hardest_worth: int = 0
    routes: int = 0
    flashes: int = 0


@dataclass
class Week:
    """Counts of a week; `begins` is its Monday, `tops` and `points` sum its sessions."""

    begins: date
    sessions: int = 0
    ascents: int = 0
    tops: int = 0
    points: int = 0


@dataclass
class GradeProgress:
    """The number of current routes of a grade, and how many of them are topped."""

    system: str
    grade: str
    colour: str
    done: int
    of: int


@dataclass
class Style:
    """Numbers of tried, topped and flashed routes of one kind.

    `kind` is of `styles.STEEPNESS`, or the main hold type of a route.
    """

    kind: str
    tried: int = 0
    topped: int = 0
    flashed: int = 0


@dataclass
class Progress:
    """A climber's progress.

    Parameters
    ----------
    grades : from the easiest; months, weeks : from the first, including empty ones.
    streak, longest : weeks in a row with a session; the present week may still be empty.
    discipline, disciplines : of these figures, and all that the gym has. Sessions and weeks are of
        all disciplines.
    """

    discipline: Discipline
    disciplines: list[Discipline]

    sessions: int = 0
    ascents: int = 0
    tries: int = 0
    routes: int = 0
    flashes: int = 0
    streak: int = 0
    longest: int = 0
    grades: list[OfGrade] = field(default_factory=list)
    months: list[Month] = field(default_factory=list)
    weeks: list[Week] = field(default_factory=list)
    current: list[GradeProgress] = field(default_factory=list)
    steepness: list[Style] = field(default_factory=list)
    holds: list[Style] = field(default_factory=list)


def progress(
    session: Session, gym: Gym, person: UUID, at: datetime, discipline: Discipline
) -> Progress:
    """Return the progress of one person in one gym.

    Parameters
    ----------
    at : now; discipline : one that `counted_as` returns.
    """
    zone = zone_of(gym)
    done = _read_ascents(session, gym, person, discipline)
    visits = session.scalars(
        select(ClimbingSession)
        .where(
            ClimbingSession.person_id == person,
            ClimbingSession.gym_id == gym.id,
            ClimbingSession.ascents > 0,
        )
        .order_by(ClimbingSession.began_at)
    ).all()
    tops = [one for one in done if one.kind in TOPS]
    today = gym_day(at, zone)
    monday = _monday_of(today)
    came = {_monday_of(visit.day) for visit in visits}
    streak, longest = _count_streaks(came, monday)
    steepness, holds = _tops_by_style(session, done)
    return Progress(
        discipline=discipline,
        disciplines=disciplines_of(session, gym.id),
        sessions=len(visits),
        ascents=len(done),
        tries=sum(one.tries for one in done if one.kind != "project"),
        routes=len({one.route for one in tops}),
        flashes=len({one.route for one in tops if one.kind in FIRST_TRIES}),
        streak=streak,
        longest=longest,
        grades=_tops_by_grade(tops),
        months=_months_of_tops([(f"{gym_day(one.at, zone):%Y-%m}", one) for one in tops], today),
        weeks=_last_weeks(visits, monday),
        current=_current_routes(session, gym, {one.route for one in tops}, discipline),
        steepness=steepness,
        holds=holds,
    )


def _read_ascents(session: Session, gym: Gym, person: UUID, discipline: Discipline) -> list[_Done]:
    columns = (
        Ascent.climbed_route,
        Ascent.kind,
        Ascent.tries,
        Ascent.grade,
        Ascent.worth,
        Ascent.climbed_at,
    )
    own = select(*columns).where(
        Ascent.person_id == person,
        Ascent.gym_id == gym.id,
        Ascent.taken_back_at.is_(None),
        Ascent.discipline.in_([one for one in Discipline if counted_as(one) == discipline]),
    )
    return [_Done(*row) for row in session.execute(own)]


def _monday_of(day: date) -> date:
    return day - timedelta(days=day.weekday())


def _count_streaks(came: set[date], monday: date) -> tuple[int, int]:
    """Return the current and the longest streak of weeks."""
    longest, row, before = 0, 0, None
    for week in sorted(came):
        row = row + 1 if before is not None and week - before == _WEEK else 1
        longest, before = max(longest, row), week
    is_present = before is not None and monday - before <= _WEEK
    return (row if is_present else 0), longest


def _tops_by_grade(tops: Iterable[_Done]) -> list[OfGrade]:
    """Return the topped routes by the grade of their last top, in order of difficulty."""
    last: dict[UUID | None, _Done] = {}
    flashed = set()
    for one in sorted(tops, key=lambda one: one.at):
        last[one.route] = one
        if one.kind in FIRST_TRIES:
            flashed.add(one.route)
    found: dict[str, OfGrade] = {}
    for one in last.values():
        row = found.setdefault(one.grade, OfGrade(one.grade, 0))
        row.worth = max(row.worth, one.worth or 0)
        row.routes += 1
        row.flashes += one.route in flashed
    return sorted(found.values(), key=lambda row: (row.worth, row.grade))


def _months_of_tops(tops: Sequence[tuple[str, _Done]], today: date) -> list[Month]:
    if not tops:
        return []
    found = {name: Month(name) for name in _month_names(min(name for name, _ in tops), today)}
    routes = Counter(name for name, _ in {(name, one.route) for name, one in tops})
    flashed = {(name, one.route) for name, one in tops if one.kind in FIRST_TRIES}
    flashes = Counter(name for name, _ in flashed)
    for name, one in tops:
        month = found[name]
        if (one.worth or 0) > month.hardest_worth:
            month.hardest, month.hardest_worth = one.grade, one.worth or 0
    for name, month in found.items():
        month.routes, month.flashes = routes[name], flashes[name]
    return list(found.values())


def _month_names(first: str, today: date) -> list[str]:
    """Return the months from the first to this one."""
    year, month = (int(part) for part in first.split("-"))
    whole = (today.year - year) * 12 + today.month - month
    return [
        f"{year + (month - 1 + n) // 12:04d}-{(month - 1 + n) % 12 + 1:02d}"
        for n in range(whole + 1)
    ]


def _last_weeks(visits: Sequence[ClimbingSession], monday: date) -> list[Week]:
    """Return the weeks of the last year."""
    if not visits:
        return []
    first = max(_monday_of(visits[0].day), monday - (_WEEKS - 1) * _WEEK)
    found = {
        begins: Week(begins)
        for begins in (first + n * _WEEK for n in range((monday - first).days // 7 + 1))
    }
    for visit in visits:
        week = found.get(_monday_of(visit.day))
        if week is not None:
            week.sessions += 1
            week.ascents += visit.ascents
            week.tops += visit.tops
            week.points += visit.points
    return list(found.values())


def _current_routes(
    session: Session, gym: Gym, topped: set[UUID | None], discipline: Discipline
) -> list[GradeProgress]:
    """Return rows by the gym's grade systems, from the easiest grade, without empty ones."""
    current = session.execute(
        select(Route.id, Route.grade_system_id, Route.grade, RopeLine.belays)
        .join(Wall, Wall.id == Route.wall_id)
        .outerjoin(RopeLine, RopeLine.id == Route.line_id)
        .where(Wall.gym_id == gym.id, Route.stripped_at.is_(None), Route.grade != "")
    ).all()
    rows = [row for row in current if discipline in map(counted_as, disciplines_on(row.belays))]
    of = Counter((row.grade_system_id, row.grade) for row in rows)
    done = Counter((row.grade_system_id, row.grade) for row in rows if row.id in topped)
    systems = session.scalars(
        select(GradeSystem)
        .where(GradeSystem.gym_id == gym.id)
        .order_by(GradeSystem.created_at, GradeSystem.id)
    )
    found = []
    for system in systems:
        for grade in system.grades:
            key = (system.id, str(grade["label"]))
            if of[key]:
                found.append(_grade_progress(system.name, grade, done[key], of[key]))
    return found


def _tops_by_style(session: Session, done: Sequence[_Done]) -> tuple[list[Style], list[Style]]:
    """Return counts by steepness and by main hold type, as the scans measured them."""
    best: dict[UUID, int] = {}  # 0: tried, 1: topped, 2: flashed
    for one in done:
        if one.route is not None and one.kind != "project":
            came_to = 2 if one.kind in FIRST_TRIES else 1 if one.kind in TOPS else 0
            best[one.route] = max(best.get(one.route, 0), came_to)
    steep = {kind: Style(kind) for kind in STEEPNESS}
    of_type: dict[str, Style] = {}
    for route, (degrees, types) in _placed_routes(session, list(best)).items():
        styles = []
        if kind := steepness_of(degrees):
            styles.append(steep[kind])
        if most := main_hold(types):
            styles.append(of_type.setdefault(most, Style(most)))
        for style in styles:
            style.tried += 1
            style.topped += best[route] > 0
            style.flashed += best[route] > 1
    return (
        [style for style in steep.values() if style.tried],
        sorted(of_type.values(), key=lambda style: (-style.tried, style.kind)),
    )


def _placed_routes(
    session: Session, routes: Sequence[UUID]
) -> dict[UUID, tuple[float | None, dict[str, int]]]:
    """Return steepness and holds of routes in their latest scan."""
    found: dict[UUID, tuple[float | None, dict[str, int]]] = {}
    for begin in range(0, len(routes), _AT_ONCE):
        rows = session.execute(
            select(Placement.route_id, Placement.steepness_deg, Placement.hold_types)
            .join(Scan, Scan.id == Placement.scan_id)
            .where(Placement.route_id.in_(routes[begin : begin + _AT_ONCE]))
            .order_by(Scan.created_at)
        )
        found |= {route: (degrees, types) for route, degrees, types in rows}
    return found


def _grade_progress(system: str, grade: Mapping[str, str], done: int, of: int) -> GradeProgress:
    return GradeProgress(system, grade["label"], grade.get("colour") or "", done, of)
