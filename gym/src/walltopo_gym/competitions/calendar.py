"""Dates of competitions, for calendars."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Competition, Entry
from walltopo_gym.database.engine import Database
from walltopo_gym.events import ComingDates, CompetitionBegins, GymDate, publish_event
from walltopo_gym.gyms.models import Gym


@dataclass(frozen=True)
class Date:
    """A public competition's begin and end."""

    competition_id: UUID
    name: str
    about: str
    starts_at: datetime
    ends_at: datetime | None


_BEGINS: Final = timedelta(hours=24)


def add_dates(session: Session, question: ComingDates) -> None:
    """Answer with the competitions that are not over."""
    gym = session.get_one(Gym, question.gym)
    if "competitions" in gym.features_off:
        return
    question.found.extend(
        GymDate(
            "competition",
            f"competition-{each.competition_id}",
            each.starts_at,
            each.name,
            f"/g/{gym.slug}/competitions/{each.competition_id}",
            each.ends_at,
        )
        for each in dates_of(session, gym.id)
        if (each.ends_at or each.starts_at) > now() and each.starts_at < question.until
    )


def tell_begins(database: Database) -> None:
    """Tell the competitions that begin within a day."""
    soon = select(Competition).where(
        Competition.state != "draft",
        Competition.starts_at > now(),
        Competition.starts_at < now() + _BEGINS,
    )
    with database.reading() as session:
        if session.scalars(soon.limit(1)).first() is None:
            return
    with database.writing() as session:
        for competition in session.scalars(soon):
            gym = session.get_one(Gym, competition.gym_id)
            entered = select(Entry.person_id).where(
                Entry.competition_id == competition.id, Entry.withdrawn.is_(False)
            )
            people = frozenset(person for person in session.scalars(entered) if person is not None)
            if competition.starts_at is not None and "competitions" not in gym.features_off:
                at = competition.starts_at
                event = CompetitionBegins(gym.id, competition.id, competition.name, at, people)
                publish_event(session, event)


def dates_of(session: Session, gym_id: UUID) -> list[Date]:
    """Return a gym's competitions that have a date and are not drafts, the earliest first."""
    rows = (
        select(Competition)
        .where(
            Competition.gym_id == gym_id,
            Competition.state != "draft",
            Competition.starts_at.is_not(None),
        )
        .order_by(Competition.starts_at, Competition.id)
    )
    return [
        Date(row.id, row.name, row.about, row.starts_at, row.ends_at)
        for row in session.scalars(rows)
        if row.starts_at is not None
    ]
