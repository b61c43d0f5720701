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
    wanted = _route_features(session, route)
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
    table = np.ma.masked_invalid(np.array([wanted, *others], np.float64))
    spread = np.ma.masked_equal(table.std(axis=0), 0.0)
    away = (table[1:] - table[0]) / spread
    return np.ma.sqrt((away**2).mean(axis=1)).filled(np.inf)


def _route_features(session: Session, route: UUID) -> list[float | None] | None:
    placed = (
        select(Placement.features)
        .join(Scan, Scan.id == Placement.scan_id)
        .where(Placement.route_id == route, Placement.features.is_not(None))
        .order_by(Scan.published_at.desc())
    )
    return session.scalars(placed.limit(1)).first()
