"""The heights of climbers that reach the top of a route."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.on_wall import climb_of, on_route
from walltopo_climb.movement.sequence import find_sequence

# Metres, from a child of seven to a tall adult, with arm spans as long as they are high.
HEIGHTS: Final = (1.20, 1.35, 1.50, 1.65, 1.80, 1.95)


def reaching_heights(route: Route, holds: Sequence[Hold], unit: float) -> tuple[float, ...] | None:
    """Return those of `HEIGHTS` for which there are moves to the top; None if it is no climb.

    Parameters
    ----------
    holds : all holds of the wall. unit : scan units per metre.
    """
    climb = climb_of(route, on_route(route, holds, unit), unit)
    if climb is None:
        return None
    found = ((height, find_sequence(climb, Body(height))) for height in HEIGHTS)
    return tuple(height for height, moves in found if moves is not None and moves.reached)
