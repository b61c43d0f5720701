"""New routes of a gym."""

from __future__ import annotations

from datetime import timedelta
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.gyms.days import today
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.versions import gym_routes


def new_routes(session: Session, gym: Gym, days: int, wall: UUID | None = None) -> list[Route]:
    """Return the current routes of at most so many days, the newest first; of one wall, or of
    all."""
    since = today(gym) - timedelta(days=days - 1)
    found = [
        route
        for route, _ in gym_routes(session, gym.id)
        if route.set_on >= since and wall in (None, route.wall_id)
    ]
    return sorted(found, key=lambda route: route.set_on, reverse=True)
