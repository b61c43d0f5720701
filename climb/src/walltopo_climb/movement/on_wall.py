"""Convert a route of a scan to a climb."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.movement.grips import (
    FOOT_ONLY,
    NEUTRAL,
    TYPES,
    Grips,
    best_pull,
    foot_share,
    hand_quality,
)
from walltopo_climb.movement.sequence import Climb

Floats = npt.NDArray[np.float64]

_BESIDE = 1.2  # m: a volume farther than this from every hold of a route is not used
_NEAR = 4  # number of nearby holds whose normals give the heading of the wall


def on_route(route: Route, holds: Sequence[Hold], unit: float) -> tuple[Hold, ...]:
    """Return the holds that may be used on a route: its own, and volumes close by.

    Parameters
    ----------
    unit : scan units per metre.
    """
    own = [hold for hold in holds if hold.id in set(route.holds)]
    places = np.array([hold.position for hold in own]).reshape(-1, 3)

    def close(hold: Hold) -> bool:
        away = np.linalg.norm(places - np.array(hold.position), axis=1)
        return bool(len(away)) and float(away.min()) < _BESIDE * unit

    volumes = [hold for hold in holds if hold.role == "volume" and hold not in own and close(hold)]
    return (*own, *volumes)


def climb_of(route: Route, holds: Sequence[Hold], unit: float) -> Climb | None:
    """Return the climb of a route, or None if it has no start, no top, or no hold between.

    Parameters
    ----------
    holds : the result of `on_route`; the climb indexes them.
    """
    index = {hold.id: k for k, hold in enumerate(holds)}
    start = tuple(index[i] for i in route.start if i in index)
    top = tuple(index[i] for i in route.top if i in index)
    if not start or not top or len(holds) < 3 or set(start) == set(top):
        return None
    feet = set(route.footholds) - set(route.start) - set(route.top)
    return Climb(grips_of(holds, feet, unit), start, top)


def grips_of(holds: Sequence[Hold], feet: set[int], unit: float) -> Grips:
    """Return the forces that hands and feet can put on holds of a scan.

    Parameters
    ----------
    feet : ids of holds for feet only. unit : scan units per metre.
    """
    position = np.array([hold.position for hold in holds]) / unit
    normal = np.array([hold.normal for hold in holds])
    steepness = np.array([hold.steepness_deg for hold in holds])
    wall = wall_normals(position, normal, steepness)
    return Grips(
        position=position,
        wall=wall,
        pull=best_pull(normal, wall),
        hand=np.array(
            [
                FOOT_ONLY if hold.id in feet else hand_quality(hold.type, hold.size / unit)
                for hold in holds
            ]
        ),
        outward=np.array([TYPES.get(hold.type, NEUTRAL).outward for hold in holds]),
        foot=foot_share(steepness),
    )


def wall_normals(position: Floats, normal: Floats, steepness_deg: Floats) -> Floats:
    """Return (N, 3) unit normals of the wall under each hold.

    The heading is that of the nearby holds, the steepness is the scan's measurement.
    """
    walls = np.zeros_like(normal)
    for k, place in enumerate(position):
        near = np.argsort(np.linalg.norm(position - place, axis=1), kind="stable")[:_NEAR]
        heading = normal[near, :2].sum(axis=0)
        length = float(np.linalg.norm(heading))
        # Under a roof no heading remains: any is correct.
        heading = heading / length if length > 1e-6 else np.array([0.0, -1.0])
        lean = math.radians(float(steepness_deg[k]))
        walls[k] = (*(math.cos(lean) * heading), -math.sin(lean))
    return walls
