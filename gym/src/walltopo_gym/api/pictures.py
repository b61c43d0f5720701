"""Pictures of walls and routes: for lists, while a wall loads, and for links that are passed on."""

from __future__ import annotations

from uuid import UUID

from fastapi import APIRouter, Response
from sqlalchemy import select

from walltopo_gym.api.rules import GuestMay
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.walls import wall_of
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.pictures import route_picture, wall_picture

router = APIRouter(tags=["pictures"])


class Picture(Response):
    media_type = "image/jpeg"


@router.get("/gyms/{gym}/walls/{wall}/picture", response_class=Picture)
def read_wall_picture(wall: UUID, session: Db, services: ServicesOf, access: GuestMay) -> Picture:
    """The published version from the front."""
    scan = wall_of(session, access.gym.id, wall).published_scan_id
    if scan is None:
        raise NotFoundError("nothing of this wall is published yet")
    return Picture(wall_picture(services.store, scan), headers=_caching(access.gym.visibility))


@router.get("/gyms/{gym}/routes/{route}/picture", response_class=Picture)
def read_route_picture(route: UUID, session: Db, services: ServicesOf, access: GuestMay) -> Picture:
    """A route in the version of the wall that is published."""
    placed = session.scalar(
        select(Placement)
        .join(Route, Route.id == Placement.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Route.id == route, Wall.gym_id == access.gym.id)
        .where(Placement.scan_id == Wall.published_scan_id)
    )
    if placed is None:
        raise NotFoundError("no such route on the published wall")
    picture = route_picture(services.store, placed.scan_id, placed.holds)
    return Picture(picture, headers=_caching(access.gym.visibility))


def _caching(visibility: str) -> dict[str, str]:
    """A day: addresses that are given out name the version, which never changes."""
    return {"cache-control": f"{'private' if visibility == 'private' else 'public'}, max-age=86400"}
