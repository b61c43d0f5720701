"""Dates of competitions, for calendars."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.competitions.models import Competition


@dataclass(frozen=True)
class Date:
    """A public competition's begin and end."""

    competition_id: UUID
    name: str
    about: str
    starts_at: datetime
    ends_at: datetime | None


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
