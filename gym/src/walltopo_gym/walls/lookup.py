"""Find a wall of a gym."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.errors import NotFoundError
from walltopo_gym.walls.models import Wall


def wall_of(session: Session, gym: UUID, wall: UUID) -> Wall:
    """Return a wall of this gym.

    Raises
    ------
    NotFoundError : this gym has no such wall.
    """
    row = session.get(Wall, wall)
    if row is None or row.gym_id != gym:
        raise NotFoundError("not-there-wall")
    return row
