"""A route of a scan as a climb."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from walltopo.scans.holds import HoldRow
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

_BESIDE = 1.2  # m: a volume farther from every hold of a route is none that one steps on
_NEAR = 4  # holds whose normals together say where the wall faces


def on_route(route: Route, holds: Sequence[HoldRow], unit: float) -> tuple[HoldRow, ...]:
    """The holds that one may use on a route: its own, and volumes close by.

    Parameters
    ----------
    unit : how many units of the scan a metre is.
    """
    own = [hold for hold in holds if hold.id in set(route.holds)]
    places = np.array([hold.position for hold in own]).reshape(-1, 3)

    def close(hold: HoldRow) -> bool:
        away = np.linalg.norm(places - np.array(hold.position), axis=1)
        return bool(len(away)) and float(away.min()) < _BESIDE * unit

    volumes = [hold for hold in holds if hold.role == "volume" and hold not in own and close(hold)]
    return (*own, *volumes)


def climb_of(route: Route, holds: Sequence[HoldRow], unit: float) -> Climb | None:
    """The climb of a route; None where it has no start, no top, or nothing between.

    Parameters
    ----------
    holds : as of `on_route`, in that order: the climb's indices are those of them.
    """
    index = {hold.id: k for k, hold in enumerate(holds)}
    start = tuple(index[i] for i in route.start if i in index)
    top = tuple(index[i] for i in route.top if i in index)
    if not start or not top or len(holds) < 3 or set(start) == set(top):
        return None
    feet = set(route.footholds) - set(route.start) - set(route.top)
    return Climb(grips_of(holds, feet, unit), start, top)


def grips_of(holds: Sequence[HoldRow], feet: set[int], unit: float) -> Grips:
    """What hands and feet can do with holds of a scan.

    Parameters
    ----------
    feet : ids of holds for feet alone. unit : how many units of the scan a metre is.
    """
    position = np.array([hold.position for hold in holds]) / unit
    normal = np.array([hold.normal for hold in holds])
    steepness = np.array([hold.steepness_deg for hold in holds])
    wall = _walls(position, normal, steepness)
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


def _walls(position: Floats, normal: Floats, steepness_deg: Floats) -> Floats:
    """(N, 3) unit normals of the wall under each hold: the heading of the holds near it, the
    steepness that the scan measured."""
    walls = np.zeros_like(normal)
    for k, place in enumerate(position):
        near = np.argsort(np.linalg.norm(position - place, axis=1), kind="stable")[:_NEAR]
        heading = normal[near, :2].sum(axis=0)
        length = float(np.linalg.norm(heading))
        # Under a roof no heading is left: any is right.
        heading = heading / length if length > 1e-6 else np.array([0.0, -1.0])
        lean = math.radians(float(steepness_deg[k]))
        walls[k] = (*(math.cos(lean) * heading), -math.sin(lean))
    return walls
