"""Find the walls of a gym."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.errors import NotFoundError
from walltopo_gym.walls.disciplines import Discipline, counted_disciplines
from walltopo_gym.walls.models import RopeLine, Wall


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


def walls_of(session: Session, gym: UUID) -> list[Wall]:
    """Return the walls of a gym from left to right."""
    rows = select(Wall).where(Wall.gym_id == gym).order_by(Wall.place, Wall.name)
    return list(session.scalars(rows))


def disciplines_of(session: Session, gym: UUID) -> list[Discipline]:
    """Return the disciplines with boards of their own in a gym, by its walls' lines of ropes.

    Lines that are gone count too, so that their climbs stay visible.
    """
    here = select(RopeLine.belays).join(Wall, Wall.id == RopeLine.wall_id)
    belays = session.scalars(here.where(Wall.gym_id == gym))
    return counted_disciplines([belay for line in belays for belay in line])
