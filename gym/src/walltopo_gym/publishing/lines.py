"""Lines of ropes on a wall, and the routes that are climbed on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final
from uuid import UUID

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import RopeLine, Wall

# A route ends at its anchor: its highest hold is about as high, in metres. Routes of a line lie
# within an arm's span of the rope on both sides.
_FROM_ANCHOR_M: Final = 1.5
_BESIDE_M: Final = 1.5


def lines_of(session: Session, wall: UUID) -> Sequence[RopeLine]:
    """Return the present lines of a wall in the order in which they were added."""
    rows = select(RopeLine).where(RopeLine.wall_id == wall, RopeLine.removed_at.is_(None))
    return session.scalars(rows.order_by(RopeLine.created_at, RopeLine.id)).all()


def line_of(session: Session, wall: UUID, line: UUID) -> RopeLine:
    """Return a present line of a wall.

    Raises
    ------
    NotFoundError : the wall has no such line.
    """
    row = session.get(RopeLine, line)
    if row is None or row.wall_id != wall or row.removed_at is not None:
        raise NotFoundError("not-there-line")
    return row


def check_line(session: Session, wall: UUID, facts: Mapping[str, Any]) -> None:
    """Check the line among the facts of a route of a wall, if they name one.

    Raises
    ------
    RequestError : the wall has no such line.
    """
    if facts.get("line_id") is None:
        return
    try:
        line_of(session, wall, facts["line_id"])
    except NotFoundError as error:
        raise RequestError("not-there-line") from error


def store_line(
    session: Session, wall: Wall, line: UUID, facts: Mapping[str, Any]
) -> tuple[RopeLine, bool]:
    """Add or change a line; return it and whether it is new.

    Parameters
    ----------
    line : chosen by the sender, so that a repeated request adds nothing.
    facts : columns of `RopeLine`.

    Raises
    ------
    ConflictError : another line of the wall has the label, or the id is another wall's.
    """
    row = session.get(RopeLine, line)
    is_new = row is None
    if row is not None and (row.wall_id != wall.id or row.removed_at is not None):
        raise ConflictError("id-taken", "id-another")
    others = (other for other in lines_of(session, wall.id) if other.id != line)
    if any(other.label == facts["label"] for other in others):
        raise ConflictError("line-label-taken", label=facts["label"])
    row = row or RopeLine(id=line, wall_id=wall.id)
    for name, value in facts.items():
        setattr(row, name, value)
    session.add(row)
    wall.revision += 1
    session.flush()
    return row, is_new


def remove_line(session: Session, wall: Wall, line: RopeLine) -> None:
    """Remove a line; its row stays for the routes that were climbed on it.

    Raises
    ------
    ConflictError : current routes are climbed on it.
    """
    on_it = select(Route).where(Route.line_id == line.id, Route.stripped_at.is_(None))
    current = session.scalars(on_it).all()
    if current:
        names = ", ".join(route.name or route.colour for route in current)
        raise ConflictError("line-has-routes", "line-move-routes", label=line.label, routes=names)
    line.removed_at = now()
    wall.revision += 1


def probable_line(
    lines: Sequence[RopeLine], holds: Sequence[tuple[float, float, float]]
) -> RopeLine | None:
    """Return the line on which a route probably hangs: the nearest whose anchor the route reaches.

    Parameters
    ----------
    holds : places of the route's holds, in metres in the frame of the wall's scans.
    """
    if not holds:
        return None
    places = np.asarray(holds)
    found = [
        (_mean_distance(places, np.asarray(line.points)), line)
        for line in lines
        if len(line.points) > 1 and abs(places[:, 2].max() - line.points[-1][2]) <= _FROM_ANCHOR_M
    ]
    distance, nearest = min(found, key=lambda pair: pair[0], default=(np.inf, None))
    return nearest if distance <= _BESIDE_M else None


def _mean_distance(places: np.ndarray, points: np.ndarray) -> float:
    """Return the mean distance of places from a line through points, in metres.

    Parameters
    ----------
    places : (n, 3); points : (m, 3), at least two.
    """
    begins, spans = points[:-1], np.diff(points, axis=0)
    lengths = np.maximum((spans**2).sum(axis=1), 1e-12)
    offsets = places[:, None] - begins
    shares = ((offsets * spans).sum(axis=2) / lengths).clip(0, 1)
    gaps = np.linalg.norm(offsets - shares[..., None] * spans, axis=2)
    return float(gaps.min(axis=1).mean())
