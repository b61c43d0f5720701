"""Routes of a wall's current version and of its former ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final
from uuid import UUID

from sqlalchemy import and_, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.errors import NotFoundError
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State
from walltopo_gym.walls.models import Wall

_CURRENT: Final = (
    select(Route, Placement)
    .join(Wall, Wall.id == Route.wall_id)
    .outerjoin(
        Placement,
        and_(Placement.route_id == Route.id, Placement.scan_id == Wall.published_scan_id),
    )
    .where(Route.stripped_at.is_(None), or_(Route.by_hand, Placement.route_id.is_not(None)))
)
# Routes without a placement come last, in the order in which they were added.
_BY_NUMBER: Final = (
    Placement.number.is_(None),
    Placement.number,
    Route.created_at,
    Route.name,
    Route.id,
)


def wall_routes(session: Session, wall: Wall) -> list[tuple[Route, Placement | None]]:
    """Return the current routes of a wall by number, then those without a placement."""
    rows = session.execute(_CURRENT.where(Route.wall_id == wall.id).order_by(*_BY_NUMBER))
    return [(route, placement) for route, placement in rows]


def gym_routes(session: Session, gym: UUID) -> list[tuple[Route, Placement | None]]:
    """Return the current routes of a gym, wall by wall, as `wall_routes` orders them."""
    rows = _CURRENT.where(Wall.gym_id == gym).order_by(Wall.place, Wall.name, *_BY_NUMBER)
    return [(route, placement) for route, placement in session.execute(rows)]


def unplaced_routes(session: Session, wall: Wall) -> list[Route]:
    """Return the current routes that were added by hand and that no placement shows yet."""
    return [route for route, placement in wall_routes(session, wall) if placement is None]


_FACTS: Final = ("name", "colour", "grade", "setter", "tags")


def store_route_facts(session: Session, scan: UUID) -> None:
    """Store a version's route facts when another version replaces it."""
    for placement, route in _placed_routes(session, scan):
        placement.as_was = {name: getattr(route, name) for name in _FACTS}


def routes_as_they_were(
    session: Session, scan: UUID
) -> Iterator[tuple[Placement, Route, dict[str, Any]]]:
    """Return the routes of a version by number, with their facts at that time."""
    for placement, route in _placed_routes(session, scan):
        facts_now = {name: getattr(route, name) for name in _FACTS}
        yield placement, route, facts_now if placement.as_was is None else placement.as_was


def versions_of(session: Session, wall: UUID, route: UUID | None = None) -> Sequence[Scan]:
    """Return the published versions of a wall, the earliest first.

    Parameters
    ----------
    route : only versions with this route.
    """
    shown = select(Scan).where(
        Scan.wall_id == wall, Scan.state.in_((State.PUBLISHED, State.SUPERSEDED))
    )
    if route is not None:
        placed = select(Placement.scan_id).where(Placement.route_id == route)
        shown = shown.where(Scan.id.in_(placed))
    return session.scalars(shown.order_by(Scan.published_at, Scan.id)).all()


def _placed_routes(session: Session, scan: UUID) -> Sequence[Any]:
    return session.execute(
        select(Placement, Route)
        .join(Route, Route.id == Placement.route_id)
        .where(Placement.scan_id == scan)
        .order_by(Placement.number)
    ).all()


def shown_placement(session: Session, gym: UUID, route: UUID) -> Placement:
    """Return a route of this gym in the published version of its wall.

    Raises
    ------
    NotFoundError : no published wall of this gym shows the route.
    """
    placed = session.scalar(
        select(Placement)
        .join(Route, Route.id == Placement.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Route.id == route, Wall.gym_id == gym)
        .where(Placement.scan_id == Wall.published_scan_id)
    )
    if placed is None:
        raise NotFoundError("not-there-published-route")
    return placed


def route_of(session: Session, gym: UUID, route: UUID) -> Route:
    """Return a route of this gym.

    Raises
    ------
    NotFoundError : this gym has no such route.
    """
    found = select(Route).join(Wall, Wall.id == Route.wall_id)
    row = session.scalar(found.where(Route.id == route, Wall.gym_id == gym))
    if row is None:
        raise NotFoundError("not-there-route")
    return row
