"""Sessions and standings, recounted from ascents in the transaction of each change.

A change of an ascent affects the sessions of its day and the standings of its month, its year and
of all time, for one person in one gym. These are recounted from the rows, so the order in which a
phone's ascents arrive does not matter. `recount_gym` does it for a whole gym.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Final, NamedTuple
from uuid import UUID

from sqlalchemy import delete, insert, select, update
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.people import lock_person
from walltopo_gym.climbing.kinds import FIRST_TRIES, TOPS
from walltopo_gym.climbing.models import Ascent, ClimbingSession, SessionMark, Standing
from walltopo_gym.climbing.points import best_of, bonus_of, worth_of
from walltopo_gym.climbing.visits import Event, Sort, Visit, visits
from walltopo_gym.database.engine import Database
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.events import DaysChanged
from walltopo_gym.gyms.days import day_begins, gym_day, zone_of
from walltopo_gym.gyms.models import GradeSystem, Gym
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.disciplines import counted_as

ALL_TIME: Final = "all"
RECOUNTS: Final = Job("recounts", at_once=1, of_one_gym=1)


class _Climbed(NamedTuple):
    """The counted fields of an ascent."""

    id: UUID
    route: UUID
    kind: str
    tries: int
    discipline: str
    grade: str
    worth: int
    circuit: str
    at: datetime

    @property
    def points(self) -> int:
        return self.worth + bonus_of(self.kind)


@dataclass
class _Sum:
    """Sums over some ascents; each route counts once."""

    points: int
    tops: int
    flashes: int


def value_ascent(session: Session, ascent: Ascent, route: Route) -> None:
    """Set the points that a top of the route is worth on the day of a new ascent."""
    system = (
        None if route.grade_system_id is None else session.get(GradeSystem, route.grade_system_id)
    )
    ascent.climbed_route = route.id
    ascent.worth, ascent.circuit = _worth_of_label(system, route.grade)


def count_again(
    session: Session, gym: Gym, person: UUID, moments: Iterable[datetime] | None
) -> None:
    """Recount the sessions and standings of these moments, for one person in one gym.

    Parameters
    ----------
    moments : of changed ascents and marks, before and after; None: all of the person's.
    """
    session.flush()
    # One person's are counted one after the other, by whichever server.
    lock_person(session, person)
    _value_bare(session, gym, person)
    days = None if moments is None else {gym_day(at, zone_of(gym)) for at in moments}
    _store_standings(session, gym, person, days)
    _regroup_sessions(session, gym, person, days)
    session.flush()


def recount_gym(database: Database, gym: UUID) -> int:
    """Recount a whole gym and return the number of people. Sessions keep their addresses.

    Each person is counted in a transaction of their own: their old figures stay until the new ones
    are there, and other writers get their turns in between.
    """
    check_unlocked("a whole gym is counted")
    with database.reading() as session:
        people: set[UUID] = set()
        for kind in (Ascent, SessionMark, Standing, ClimbingSession):
            named = select(kind.person_id).where(kind.gym_id == gym).distinct()
            people.update(session.scalars(named))
    for person in sorted(people):
        with database.writing() as session:
            found = session.get(Gym, gym)
            if found is not None and session.get(Person, person) is not None:
                count_again(session, found, person, None)
    return len(people)


def queue_recount(session: Session, event: DaysChanged) -> None:
    """Queue the recount of a whole gym, because its days begin at another time."""
    enqueue(session, RECOUNTS, str(event.gym), gym=event.gym)


def _worth_of_label(system: GradeSystem | None, label: str) -> tuple[int, str]:
    if system is None:
        return worth_of("", [], label), ""
    circuit = label if system.kind == "circuits" else ""
    return worth_of(system.kind, system.grades, label), circuit


def _value_bare(session: Session, gym: Gym, person: UUID) -> None:
    """Set the points of ascents that did not pass through `store_ascent`, such as bulk imports."""
    bare = [Ascent.gym_id == gym.id, Ascent.worth.is_(None), Ascent.person_id == person]
    pairs = session.execute(
        select(Ascent.route_id, Ascent.grade, Route.grade_system_id)
        .outerjoin(Route, Route.id == Ascent.route_id)
        .where(*bare)
        .distinct()
    ).all()
    for route, grade, system_id in pairs:
        system = None if system_id is None else session.get(GradeSystem, system_id)
        worth, circuit = _worth_of_label(system, grade)
        is_it = Ascent.route_id.is_(None) if route is None else Ascent.route_id == route
        # A deleted route has no identity: each of its ascents counts for itself.
        key = Ascent.id if route is None else Ascent.route_id
        session.execute(
            update(Ascent)
            .where(*bare, is_it, Ascent.grade == grade)
            .values(worth=worth, circuit=circuit, climbed_route=key),
            execution_options={"synchronize_session": False},
        )


def _read_ascents(
    session: Session,
    gym: Gym,
    person: UUID,
    since: datetime | None,
    until: datetime | None,
    kinds: Sequence[str] = (),
) -> list[_Climbed]:
    wanted = select(
        Ascent.id,
        Ascent.climbed_route,
        Ascent.kind,
        Ascent.tries,
        Ascent.discipline,
        Ascent.grade,
        Ascent.worth,
        Ascent.circuit,
        Ascent.climbed_at,
    ).where(Ascent.person_id == person, Ascent.gym_id == gym.id, Ascent.taken_back_at.is_(None))
    if since is not None and until is not None:
        wanted = wanted.where(Ascent.climbed_at >= since, Ascent.climbed_at < until)
    if kinds:
        wanted = wanted.where(Ascent.kind.in_(kinds))
    return [
        _Climbed(key, route, kind, tries, discipline, grade, worth, circuit, at)
        for key, route, kind, tries, discipline, grade, worth, circuit, at in session.execute(
            wanted
        )
        if route is not None and worth is not None  # all have been valued
    ]


def _sum_points(climbed: Iterable[_Climbed]) -> _Sum:
    best: dict[UUID, int] = {}
    flashed: set[UUID] = set()
    for one in climbed:
        best[one.route] = max(best.get(one.route, 0), one.points)
        if one.kind in FIRST_TRIES:
            flashed.add(one.route)
    return _Sum(best_of(best.values()), len(best), len(flashed))


def _periods_of(day: date) -> tuple[str, str, str]:
    return f"{day:%Y-%m}", f"{day:%Y}", ALL_TIME


def _store_standings(session: Session, gym: Gym, person: UUID, days: set[date] | None) -> None:
    zone = zone_of(gym)
    touched = None if days is None else {period for day in days for period in _periods_of(day)}
    sorted_in: dict[tuple[str, str, str], list[_Climbed]] = {}
    for one in _read_ascents(session, gym, person, None, None, TOPS):
        discipline = counted_as(one.discipline)
        for period in _periods_of(gym_day(one.at, zone)):
            if touched is None or period in touched:
                for circuit in {"", one.circuit}:
                    sorted_in.setdefault((period, discipline, circuit), []).append(one)
    gone = delete(Standing).where(Standing.gym_id == gym.id, Standing.person_id == person)
    session.execute(gone if touched is None else gone.where(Standing.period.in_(touched)))
    rows = [
        {"gym_id": gym.id, "person_id": person, "period": period, "discipline": discipline}
        | {"circuit": circuit}
        | vars(_sum_points(climbed))
        for (period, discipline, circuit), climbed in sorted_in.items()
    ]
    if rows:
        session.execute(insert(Standing), rows)


def _regroup_sessions(session: Session, gym: Gym, person: UUID, days: set[date] | None) -> None:
    """Recount the sessions of these days. An existing row is reused for the visit in the same place
    of its day, so that session addresses stay while ascents arrive."""
    zone = zone_of(gym)
    mine = ClimbingSession.person_id == person, ClimbingSession.gym_id == gym.id
    spans: list[tuple[datetime, datetime] | tuple[None, None]] = [(None, None)]
    there = select(ClimbingSession).where(*mine)
    if days is not None:
        spans = [(day_begins(d, zone), day_begins(d + timedelta(days=1), zone)) for d in days]
        there = there.where(ClimbingSession.day.in_(days))
    climbed: dict[UUID, _Climbed] = {}
    events: list[Event] = []
    for since, until in spans:
        for one in _read_ascents(session, gym, person, since, until):
            climbed[one.id] = one
            events.append(Event(one.at, Sort.ASCENT, one.id))
        events += _read_marks(session, gym, person, since, until)
    kept: dict[date, list[ClimbingSession]] = {}
    for row in session.scalars(there.order_by(ClimbingSession.began_at)):
        kept.setdefault(row.day, []).append(row)
    for visit in visits(events, zone):
        rows = kept.get(visit.day)
        row = rows.pop(0) if rows else ClimbingSession(person_id=person, gym_id=gym.id)
        _write_session(row, visit, [climbed[ascent] for ascent in visit.ascents])
        session.add(row)
    for rows in kept.values():
        for row in rows:
            session.delete(row)


def _read_marks(
    session: Session, gym: Gym, person: UUID, since: datetime | None, until: datetime | None
) -> list[Event]:
    wanted = select(SessionMark).where(
        SessionMark.person_id == person, SessionMark.gym_id == gym.id
    )
    if since is not None and until is not None:
        wanted = wanted.where(SessionMark.at >= since, SessionMark.at < until)
    return [
        Event(mark.at, Sort.START if mark.kind == "start" else Sort.END, mark.id)
        for mark in session.scalars(wanted)
    ]


def _write_session(row: ClimbingSession, visit: Visit, climbed: Sequence[_Climbed]) -> None:
    tops = [one for one in climbed if one.kind in TOPS]
    best: dict[UUID, int] = {}
    for one in tops:
        best[one.route] = max(best.get(one.route, 0), one.points)
    hardest = max(tops, key=lambda one: one.worth, default=None)
    row.day, row.began_at, row.ended_at = visit.day, visit.began_at, visit.ended_at
    row.closed, row.ascents = visit.closed, len(climbed)
    row.tries = sum(one.tries for one in climbed if one.kind != "project")
    row.tops, row.points = len(best), sum(best.values())
    row.flashes = len({one.route for one in tops if one.kind in FIRST_TRIES})
    row.hardest = "" if hardest is None else hardest.grade
    row.hardest_worth = 0 if hardest is None else hardest.worth
