"""Former versions of a wall, each with its routes as they were on its last day."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import State

_SAID: Final = ("name", "colour", "grade", "setter", "tags")


def keep_as_was(session: Session, scan: UUID) -> None:
    """Note what is said of a version's routes now that another version takes its place."""
    for placement, route in _placed(session, scan):
        placement.as_was = {name: getattr(route, name) for name in _SAID}


def routes_as_they_were(
    session: Session, scan: UUID
) -> Iterator[tuple[Placement, Route, dict[str, Any]]]:
    """The routes of a version by their numbers, and what was said of them then."""
    for placement, route in _placed(session, scan):
        now_said = {name: getattr(route, name) for name in _SAID}
        yield placement, route, now_said if placement.as_was is None else placement.as_was


def versions_of(session: Session, wall: UUID, route: UUID | None = None) -> Sequence[Scan]:
    """The versions of a wall that have been published, the first one first.

    Parameters
    ----------
    route : only those in which it hangs.
    """
    shown = select(Scan).where(
        Scan.wall_id == wall, Scan.state.in_((State.PUBLISHED, State.SUPERSEDED))
    )
    if route is not None:
        placed = select(Placement.scan_id).where(Placement.route_id == route)
        shown = shown.where(Scan.id.in_(placed))
    return session.scalars(shown.order_by(Scan.published_at, Scan.id)).all()


def _placed(session: Session, scan: UUID) -> Sequence[Any]:
    return session.execute(
        select(Placement, Route)
        .join(Route, Route.id == Placement.route_id)
        .where(Placement.scan_id == scan)
        .order_by(Placement.number)
    ).all()
