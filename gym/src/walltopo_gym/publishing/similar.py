"""Current routes of a gym that climb like a given one.

The distance of two routes is that of their features of the grade model, each in units of its spread
over the gym's current routes. Features that are unknown for one of the two do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from uuid import UUID

import numpy as np
import numpy.typing as npt
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.publishing.models import Placement
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.scans.models import Scan

MAX_SIMILAR: Final = 12


def similar_routes(session: Session, gym: UUID, route: UUID) -> list[UUID]:
    """Return at most `MAX_SIMILAR` current routes, the most similar first.

    The route may be stripped; its last version counts. The list is empty if the movement model
    finds no moves for an adult on the route, or has not computed them.
    """
    wanted = _features(session, route)
    if wanted is None:
        return []
    others = [
        (row.id, placement.features)
        for row, placement in gym_routes(session, gym)
        if placement is not None and placement.features is not None and row.id != route
    ]
    if not others:
        return []
    order = np.argsort(distances(wanted, [features for _, features in others]), kind="stable")
    return [others[k][0] for k in order[:MAX_SIMILAR]]


def distances(
    wanted: Sequence[float | None], others: Sequence[Sequence[float | None]]
) -> npt.NDArray[np.float64]:
    """Return the distance of each of N routes from the wanted one, (N,); inf if they have no known
    feature in common.

    Parameters
    ----------
    wanted : F features. others : N times F features.
    """
    table = np.array([wanted, *others], np.float64)
    spread = _spread(table)
    away = (table[1:] - table[0]) / spread
    known = np.isfinite(away)
    count = known.sum(axis=1)
    squares = np.where(known, away, 0.0) ** 2
    mean = squares.sum(axis=1) / np.maximum(count, 1)
    return np.where(count > 0, np.sqrt(mean), np.inf)


def _spread(table: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the standard deviation of each column; NaN for one without any."""
    known = np.isfinite(table)
    count = np.maximum(known.sum(axis=0), 1)
    values = np.where(known, table, 0.0)
    mean = values.sum(axis=0) / count
    variance = (np.where(known, table - mean, 0.0) ** 2).sum(axis=0) / count
    return np.where(variance > 0, np.sqrt(variance), np.nan)


def _features(session: Session, route: UUID) -> list[float | None] | None:
    placed = (
        select(Placement.features)
        .join(Scan, Scan.id == Placement.scan_id)
        .where(Placement.route_id == route, Placement.features.is_not(None))
        .order_by(Scan.published_at.desc())
    )
    return session.scalars(placed.limit(1)).first()
