"""Sessions of climbing: one's own, and those that others let one see."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.profiles import profile_of
from walltopo_gym.api.climbing import AscentFacts
from walltopo_gym.api.fields import Moment
from walltopo_gym.api.rules import Access, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.counted_models import ClimbingSession
from walltopo_gym.climbing.people import may_see
from walltopo_gym.climbing.sessions import ascents_of, begin, end, goes_on, tops_by_grade
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["sessions"])

ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class SessionFacts(BaseModel):
    """Ascents of one visit, counted; `tops`, `flashes` and `points` have each route once.

    `day` is the gym's; `running`: an ascent made now would be one of it.
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
    """How many routes of a grade were topped, each once."""

    grade: str
    routes: int


class SessionPage(SessionFacts):
    """A session, whose it is, and what was climbed in it; `grades` from the hardest."""

    name: str
    own: bool
    grades: list[TopsOfGrade]
    done: list[AscentFacts]


@router.get("/gyms/{gym}/sessions")
def list_climbing_sessions(
    session: Db, access: ReaderMay,
    before: Annotated[Moment | None, Query(description="begun before")] = None,
    size: Annotated[int, Query(ge=1, le=200)] = 20,
) -> list[SessionFacts]:  # fmt: skip
    """One's own sessions in this gym, the last first."""
    mine = select(ClimbingSession).where(
        ClimbingSession.person_id == access.actor.known, ClimbingSession.gym_id == access.gym.id
    )
    if before is not None:
        mine = mine.where(ClimbingSession.began_at < before)
    rows = session.scalars(mine.order_by(ClimbingSession.began_at.desc()).limit(size))
    told = [session_facts(row, access.gym) for row in rows]
    # One that was begun by hand and came to nothing is no session.
    return [facts for facts in told if facts.ascents or facts.running]


@router.post("/gyms/{gym}/sessions", status_code=201)
def start_climbing_session(session: Db, access: ClimberMay) -> SessionFacts:
    """Begin a session now; without this one begins with the first ascent."""
    return session_facts(begin(session, access.gym, access.actor.known, now()), access.gym)


@router.get("/gyms/{gym}/sessions/{visit}")
def read_climbing_session(visit: UUID, session: Db, access: ReaderMay) -> SessionPage:
    """A session with its ascents."""
    row = _of(session, access, visit)
    whose = row.person_id
    if not may_see(session, access.actor.known, whose, profile_of(session, whose).show_ascents):
        raise NotFoundError("no such session")
    facts = session_facts(row, access.gym)
    climbed = ascents_of(session, row)
    done = [AscentFacts.model_validate(ascent, from_attributes=True) for ascent in climbed]
    name = session.get_one(Person, whose).name
    grades = [TopsOfGrade(grade=grade, routes=routes) for grade, routes in tops_by_grade(climbed)]
    own = whose == access.actor.known
    return SessionPage(**dict(facts), name=name, own=own, grades=grades, done=done)


@router.post("/gyms/{gym}/sessions/{visit}/end")
def end_climbing_session(visit: UUID, session: Db, access: ClimberMay) -> SessionFacts:
    """End a session now; without this it ends by itself."""
    row = _of(session, access, visit)
    if row.person_id != access.actor.known:
        raise NotFoundError("no such session")
    end(session, access.gym, row, now())
    return session_facts(row, access.gym)


def session_facts(row: ClimbingSession, gym: Gym) -> SessionFacts:
    """A session as it is told."""
    names = SessionFacts.model_fields.keys() - {"running"}
    facts = {name: getattr(row, name) for name in names}
    return SessionFacts(**facts, running=goes_on(row, gym, now()))


def _of(session: Session, access: Access, visit: UUID) -> ClimbingSession:
    row = session.get(ClimbingSession, visit)
    if row is None or row.gym_id != access.gym.id:
        raise NotFoundError("no such session")
    return row
