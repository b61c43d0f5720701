"""What hangs now: routes with their places in the versions that are published."""

from __future__ import annotations

from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.gyms.models import Wall
from walltopo_gym.publishing.models import Placement, Route

_HANGING: Final = (
    select(Route, Placement)
    .join(Placement, Placement.route_id == Route.id)
    .where(Route.stripped_at.is_(None))
)


def wall_routes(session: Session, wall: Wall) -> list[tuple[Route, Placement]]:
    """What hangs on a wall, by number."""
    hanging = _HANGING.where(Placement.scan_id == wall.published_scan_id)
    rows = session.execute(hanging.order_by(Placement.number))
    return [(route, placement) for route, placement in rows]


def gym_routes(session: Session, gym: UUID) -> list[tuple[Route, Placement]]:
    """What hangs in a gym, wall by wall."""
    hanging = _HANGING.join(Wall, Wall.published_scan_id == Placement.scan_id)
    rows = hanging.where(Wall.gym_id == gym).order_by(Wall.place, Wall.name, Placement.number)
    return [(route, placement) for route, placement in session.execute(rows)]
