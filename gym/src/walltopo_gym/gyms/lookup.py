"""Find a gym."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.gyms.models import Gym


def gym_by_slug(session: Session, slug: str) -> Gym | None:
    """Return the gym of a slug that somebody typed; None if no gym has it."""
    if "\0" in slug:  # PostgreSQL has no such text
        return None
    return session.scalar(select(Gym).where(Gym.slug == slug))
