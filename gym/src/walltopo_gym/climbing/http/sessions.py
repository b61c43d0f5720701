"""Endpoints of climbing sessions and progress."""

from __future__ import annotations

from dataclasses import asdict
from datetime import date, datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.people import profile_of
from walltopo_gym.api.fields import Digits, Moment
from walltopo_gym.api.services import Db
from walltopo_gym.api.tables import CsvDialectOf, CsvFile
from walltopo_gym.climbing.http.ascents import AscentOut
from walltopo_gym.climbing.models import ClimbingSession
from walltopo_gym.climbing.people import may_see
from walltopo_gym.climbing.progress import progress
from walltopo_gym.climbing.sessions import ascents_of, begin, end, goes_on, tops_by_grade
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import Access, gym_rule
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.spreadsheets import csv_table
from walltopo_gym.walls.disciplines import Discipline, counted_as

router = APIRouter(tags=["sessions"])

ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class SessionOut(BaseModel):
    """Counts of one visit; `tops`, `flashes` and `points` count each route once.

    `day` is by the gym's clock; `running`: an ascent made now would belong to it.
    """

    id: UUID
    person_id: UUID
    day: date
    began_at: datetime
    ended_at: datetime
    running: bool
    ascents: int
    tries: int
    tops: int
    flashes: int
    points: int
    hardest: str


class TopsOfGrade(BaseModel):
    """The number of topped routes of a grade."""

    grade: str
    routes: int


class SessionPage(SessionOut):
    """A session, its climber and its ascents; `grades` from the hardest."""

    name: str
    own: bool
    grades: list[TopsOfGrade]
    done: list[AscentOut]


@router.get("/gyms/{gym}/sessions")
def list_climbing_sessions(
    session: Db,
    access: ReaderMay,
    before: Annotated[Moment | None, Query(description="begun before")] = None,
    size: Annotated[Digits, Query(ge=1, le=200)] = 20,
) -> list[SessionOut]:
    """Return one's own sessions in this gym, the latest first."""
    mine = select(ClimbingSession).where(
        ClimbingSession.person_id == access.actor.known, ClimbingSession.gym_id == access.gym.id
    )
    if before is not None:
        mine = mine.where(ClimbingSession.began_at < before)
    rows = session.scalars(mine.order_by(ClimbingSession.began_at.desc()).limit(size))
    listed = [session_out(row, access.gym) for row in rows]
    # One that was begun by hand and came to nothing is no session.
    return [facts for facts in listed if facts.ascents or facts.running]


@router.post("/gyms/{gym}/sessions", status_code=201)
def start_climbing_session(session: Db, access: ClimberMay) -> SessionOut:
    """Begin a session now. Without a start, the first ascent begins it."""
    return session_out(begin(session, access.gym, access.actor.known, now()), access.gym)


@router.get("/gyms/{gym}/sessions/{visit}")
def read_climbing_session(visit: UUID, session: Db, access: ReaderMay) -> SessionPage:
    """Return a session with its ascents."""
    row = _session_of_gym(session, access, visit)
    whose = row.person_id
    if not may_see(session, access.actor.known, whose, profile_of(session, whose).show_ascents):
        raise NotFoundError("not-there-session")
    facts = session_out(row, access.gym)
    climbed = ascents_of(session, row)
    done = [AscentOut.model_validate(ascent, from_attributes=True) for ascent in climbed]
    name = session.get_one(Person, whose).name
    grades = [TopsOfGrade(grade=grade, routes=routes) for grade, routes in tops_by_grade(climbed)]
    own = whose == access.actor.known
    return SessionPage(**dict(facts), name=name, own=own, grades=grades, done=done)


@router.post("/gyms/{gym}/sessions/{visit}/end")
def end_climbing_session(visit: UUID, session: Db, access: ClimberMay) -> SessionOut:
    """End a session now. Without an end, it ends by itself."""
    row = _session_of_gym(session, access, visit)
    if row.person_id != access.actor.known:
        raise NotFoundError("not-there-session")
    end(session, access.gym, row, now())
    return session_out(row, access.gym)


def session_out(row: ClimbingSession, gym: Gym) -> SessionOut:
    """Return a session's counts."""
    names = SessionOut.model_fields.keys() - {"running"}
    facts = {name: getattr(row, name) for name in names}
    return SessionOut(**facts, running=goes_on(row, gym, now()))


def _session_of_gym(session: Session, access: Access, visit: UUID) -> ClimbingSession:
    row = session.get(ClimbingSession, visit)
    if row is None or row.gym_id != access.gym.id:
        raise NotFoundError("not-there-session")
    return row


progress_router = APIRouter(tags=["progress"])

Part = Literal["grades", "months", "weeks", "current", "steepness", "holds"]


class OfGradeOut(BaseModel):
    """The topped routes of one grade; `worth`: points of a top."""

    grade: str
    worth: int
    routes: int
    flashes: int


class MonthOut(BaseModel):
    """Counts of a month, such as "2026-03"; each route counts once."""

    month: str
    hardest: str
    hardest_worth: int
    routes: int
    flashes: int


class WeekOut(BaseModel):
    """Counts of a week that begins on Monday."""

    begins: date
    sessions: int
    ascents: int
    tops: int
    points: int


class GradeProgressOut(BaseModel):
    """The number of current routes of a grade, and how many of them are topped."""

    system: str
    grade: str
    colour: str
    done: int
    of: int


class StyleOut(BaseModel):
    """Counts of routes of one steepness or main hold type; each route counts once."""

    kind: str
    tried: int
    topped: int
    flashed: int


class ProgressOut(BaseModel):
    """A climber's progress in a discipline; `disciplines` are those of the gym. `sessions`,
    `weeks`, `streak` and `longest` (weeks in a row with a session) are of all disciplines."""

    discipline: Discipline
    disciplines: list[Discipline]
    sessions: int
    ascents: int
    tries: int
    routes: int
    flashes: int
    streak: int
    longest: int
    grades: list[OfGradeOut]
    months: list[MonthOut]
    weeks: list[WeekOut]
    current: list[GradeProgressOut]
    steepness: list[StyleOut]
    holds: list[StyleOut]


@progress_router.get("/gyms/{gym}/progress")
def read_progress(
    session: Db, access: ReaderMay, discipline: Discipline = Discipline.BOULDER
) -> ProgressOut:
    """Return one's own progress in this gym; auto-belays count as top-rope."""
    return ProgressOut(**_progress_of(session, access, discipline))


@progress_router.get("/gyms/{gym}/progress/{part}.csv", response_class=CsvFile)
def read_progress_table(
    part: Part,
    session: Db,
    access: ReaderMay,
    dialect: CsvDialectOf,
    discipline: Discipline = Discipline.BOULDER,
) -> CsvFile:
    """Return one part of one's progress as CSV."""
    parts = _progress_of(session, access, discipline)
    kinds: dict[Part, type[BaseModel]] = {
        "grades": OfGradeOut,
        "months": MonthOut,
        "weeks": WeekOut,
        "current": GradeProgressOut,
        "steepness": StyleOut,
        "holds": StyleOut,
    }
    return CsvFile.of(part, csv_table(list(kinds[part].model_fields), parts[part], dialect))


def _progress_of(session: Session, access: Access, discipline: Discipline) -> dict[str, Any]:
    counted = counted_as(discipline)
    return asdict(progress(session, access.gym, access.actor.known, now(), counted))
