"""Deletion of routes that no climber has used."""

from __future__ import annotations

from sqlalchemy import exists, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.errors import ConflictError
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.walls.models import Wall


def delete_route(session: Session, route: Route) -> None:
    """Delete a route that was added by hand.

    Raises
    ------
    ConflictError : a scan shows it, or somebody has logged an ascent of it or voted on it.
    """
    # An ascent that is being stored holds the row until it can be counted here.
    session.refresh(route, with_for_update=True)
    placed = select(exists().where(Placement.route_id == route.id))
    if not route.by_hand or session.scalar(placed):
        raise ConflictError("route-of-scan", "strip-instead")
    logged = exists().where(Ascent.route_id == route.id, Ascent.taken_back_at.is_(None))
    voted = exists().where(Opinion.route_id == route.id)
    if session.scalar(select(or_(logged, voted))):
        raise ConflictError("route-in-use", "strip-instead")
    wall = session.get_one(Wall, route.wall_id, with_for_update=True)
    wall.revision += 1
    session.delete(route)
