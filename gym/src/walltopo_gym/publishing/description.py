"""Published routes in words, from the suggested moves of their version."""

from __future__ import annotations

from functools import lru_cache
from uuid import UUID

import msgspec
from msgspec.structs import replace
from sqlalchemy.orm import Session

from walltopo.scans.moves import ClimberRow
from walltopo_climb.description.sentences import Sentence, Wording, sentences_of
from walltopo_climb.description.steps import route_steps
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.review import found_routes
from walltopo_gym.publishing.version_holds import version_holds
from walltopo_gym.publishing.version_moves import suggested_climbers
from walltopo_gym.publishing.versions import shown_placement
from walltopo_gym.scans.models import Scan
from walltopo_gym.storage.files import FileStore

_USUAL_M = 1.75  # height of a climber who says none


class DescribedRoute(msgspec.Struct, frozen=True):
    """A route in words, in a version of its wall, for a body of `height` metres."""

    scan: UUID
    height: float
    sentences: tuple[Sentence, ...]


def describe_placed(
    session: Session,
    store: FileStore,
    gym: UUID,
    route: Route,
    height_cm: int | None,
    words: Wording,
) -> DescribedRoute:
    """Return a current route in words, for the body of the suggested moves that is next in height.

    Raises
    ------
    NotFoundError : no published version shows the route, or no body leaves the ground on it.
    ConflictError : the moves are not computed yet.
    """
    placed = shown_placement(session, gym, route.id)
    scan = session.get_one(Scan, placed.scan_id)
    if scan.moves is None:
        raise ConflictError("moves-not-ready")
    row = _climber(store, scan, placed.number, height_cm)
    if row is None:
        raise NotFoundError("route-without-moves")
    holds = version_holds(store, scan.id)
    numbered = _version_routes(store, scan.id)
    named = replace(numbered[placed.number], name=route.name, colour=route.colour)
    steps = route_steps(named, row, list(holds.by_id.values()), holds.unit)
    return DescribedRoute(scan.id, row.height, sentences_of(steps, words))


def _climber(store: FileStore, scan: Scan, number: int, height_cm: int | None) -> ClimberRow | None:
    """Return the moves of the body that is next in height, None if it has none on the route."""
    rows = suggested_climbers(store, scan, number)
    height = _USUAL_M if height_cm is None else height_cm / 100
    nearest = min(rows, key=lambda row: abs(row.height - height), default=None)
    return nearest if nearest is not None and nearest.moves else None


# Those of a published version never change.
_version_routes = lru_cache(maxsize=64)(found_routes)
