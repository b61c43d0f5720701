"""Dates of competitions, for calendars."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Competition, Entry
from walltopo_gym.database.engine import Database
from walltopo_gym.events import ComingDates, CompetitionBegins, GymDate, publish_event
from walltopo_gym.gyms.models import Gym

_BEGINS: Final = timedelta(hours=24)


def add_dates(session: Session, question: ComingDates) -> None:
    """Answer with the competitions that are not over."""
    gym = session.get_one(Gym, question.gym)
    if not gym.has("competitions"):
        return
    question.found.extend(
        GymDate(
            "competition",
            f"competition-{each.id}",
            at,
            each.name,
            f"/g/{gym.slug}/competitions/{each.id}",
            each.ends_at,
        )
        for each in dates_of(session, gym.id)
        if (at := each.starts_at) is not None
        and (each.ends_at or at) > now()
        and at < question.until
    )


def publish_beginnings(database: Database) -> None:
    """Publish the competitions that begin within a day; listeners must bear repetition."""
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
            at = competition.starts_at
            if at is not None and gym.has("competitions"):
                event = CompetitionBegins(gym.id, competition.id, competition.name, at, people)
                publish_event(session, event)


def dates_of(session: Session, gym_id: UUID) -> Sequence[Competition]:
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
    return session.scalars(rows).all()
