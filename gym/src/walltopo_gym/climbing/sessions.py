"""Sessions, begun and ended by hand or derived from ascents (`visits.py`)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import datetime
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.counting import count_again
from walltopo_gym.climbing.kinds import TOPS
from walltopo_gym.climbing.models import Ascent, ClimbingSession, SessionMark
from walltopo_gym.climbing.visits import PAUSE
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.days import gym_day, zone_of
from walltopo_gym.gyms.models import Gym


def last_of(session: Session, gym: Gym, person: UUID) -> ClimbingSession | None:
    """Return a person's last session in a gym."""
    mine = select(ClimbingSession).where(
        ClimbingSession.person_id == person, ClimbingSession.gym_id == gym.id
    )
    return session.scalar(mine.order_by(ClimbingSession.began_at.desc()).limit(1))


def goes_on(row: ClimbingSession, gym: Gym, at: datetime) -> bool:
    """Return whether an ascent at this moment would belong to the session."""
    is_today = row.day == gym_day(at, zone_of(gym))
    return not row.closed and is_today and at - row.ended_at < PAUSE


def begin(session: Session, gym: Gym, person: UUID, at: datetime) -> ClimbingSession:
    """Begin a session by hand; an open session without ascents is restarted."""
    last = last_of(session, gym, person)
    if last is not None and goes_on(last, gym, at) and last.ascents == 0:
        return last
    _add_mark(session, gym, person, "start", at)
    begun = last_of(session, gym, person)
    assert begun is not None
    return begun


def end(session: Session, gym: Gym, row: ClimbingSession, at: datetime) -> None:
    """End a session by hand.

    Raises
    ------
    ConflictError : it is over already.
    """
    if not goes_on(row, gym, at):
        raise ConflictError("session-over")
    _add_mark(session, gym, row.person_id, "end", at)


def ascents_of(session: Session, row: ClimbingSession) -> Sequence[Ascent]:
    """Return the ascents of a session in order of time."""
    within = select(Ascent).where(
        Ascent.person_id == row.person_id,
        Ascent.gym_id == row.gym_id,
        Ascent.climbed_at >= row.began_at,
        Ascent.climbed_at <= row.ended_at,
        Ascent.taken_back_at.is_(None),
    )
    return session.scalars(within.order_by(Ascent.climbed_at, Ascent.id)).all()


def tops_by_grade(ascents: Iterable[Ascent]) -> list[tuple[str, int]]:
    """Return the number of topped routes by grade, the hardest first."""
    tops = {(a.grade, a.worth or 0, a.climbed_route) for a in ascents if a.kind in TOPS}
    routes = Counter(grade for grade, _, _ in tops)
    worth = {grade: worth for grade, worth, _ in tops}
    return sorted(routes.items(), key=lambda row: (-worth[row[0]], row[0]))


def _add_mark(session: Session, gym: Gym, person: UUID, kind: str, at: datetime) -> None:
    session.add(SessionMark(person_id=person, gym_id=gym.id, kind=kind, at=at))
    count_again(session, gym, person, [at])
