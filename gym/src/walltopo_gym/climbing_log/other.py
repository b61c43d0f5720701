"""Ascents outdoors, in another gym or on a board."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, date, datetime, time
from typing import Final, Literal
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.people import lock_person
from walltopo_gym.climbing.kinds import FIRST_TRIES
from walltopo_gym.climbing_log.models import OtherAscent
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.events import LoggedClimb, LoggedClimbs
from walltopo_gym.gyms.days import gym_day

_UTC: Final = ZoneInfo("UTC")
Venue = Literal["outdoors", "gym", "board"]
Discipline = Literal["", "boulder", "lead", "top-rope", "auto-belay"]
OtherKind = Literal["onsight", "flash", "top", "repeat", "try", "project"]


@dataclass(frozen=True)
class OtherClimb:
    """The content of an ascent elsewhere, as `OtherAscent` keeps it."""

    venue: Venue
    discipline: Discipline
    name: str
    location: str
    grade: str
    kind: OtherKind
    tries: int
    note: str
    climbed_at: datetime


def noon_of(day: date) -> datetime:
    """Return the moment that stands for a day without a time."""
    return datetime.combine(day, time(12), UTC)


def day_of(at: datetime) -> date:
    """Return the day of an ascent elsewhere: as in gyms, an evening past midnight is one day."""
    return gym_day(at, _UTC)


def store_other(session: Session, ascent: UUID, person: UUID, climb: OtherClimb) -> bool:
    """Store or replace an ascent elsewhere; return whether it is new. A withdrawn one stays so.

    Raises
    ------
    RequestError : an onsight or a flash in several tries, or a day of the future.
    ConflictError : the id belongs to another person.
    """
    if climb.kind in FIRST_TRIES and climb.tries != 1:
        raise RequestError("flash-one-try", tries=climb.tries)
    if climb.climbed_at.date() > latest_day():
        raise RequestError("ascent-in-future", "ascent-check-clock", day=climb.climbed_at.date())
    lock_person(session, person)
    row = session.get(OtherAscent, ascent)
    if row is None:
        session.add(OtherAscent(id=ascent, person_id=person, source="", **vars(climb)))
        return True
    if row.person_id != person:
        raise ConflictError("id-taken", "id-another")
    if row.withdrawn_at is None:
        for name, value in vars(climb).items():
            setattr(row, name, value)
    return False


def withdraw_other(session: Session, ascent: UUID, person: UUID) -> None:
    """Delete an ascent elsewhere with its words; repeating it is fine.

    Raises
    ------
    NotFoundError : this person has no ascent with that id.
    """
    row = session.get(OtherAscent, ascent)
    if row is None or row.person_id != person:
        raise NotFoundError("not-there-ascent")
    row.withdrawn_at = row.withdrawn_at or now()
    row.name = row.location = row.grade = row.note = ""


def latest_day() -> date:
    """Return today's date where the day begins first (UTC+14)."""
    return now().astimezone(ZoneInfo("Pacific/Kiritimati")).date()


def logged_others(session: Session, question: LoggedClimbs) -> None:
    """Add a person's ascents elsewhere."""
    mine = question.rows_of(OtherAscent.person_id, OtherAscent.climbed_at)
    mine.append(OtherAscent.withdrawn_at.is_(None))
    question.found.extend(
        LoggedClimb(
            id=row.id,
            origin="other",
            at=row.climbed_at,
            day=day_of(row.climbed_at),
            kind=row.kind,
            tries=row.tries,
            name=row.name,
            grade=row.grade,
            location=row.location,
            note=row.note,
            venue=row.venue,
            discipline=row.discipline,
        )
        for row in session.scalars(select(OtherAscent).where(*mine))
    )
