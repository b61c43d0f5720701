"""The heights of climbers that reach the top of a route."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile
from typing import Final, Literal, TypeAlias

from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.on_wall import climb_of, on_route
from walltopo_climb.movement.sequence import Climb, find_sequence, longest_reach
from walltopo_climb.movement.sequence import Sequence as Moves

# Metres, from a child of seven to a tall adult, with arm spans as long as they are high.
HEIGHTS: Final = (1.20, 1.35, 1.50, 1.65, 1.80, 1.95)

# Share by which the arm spans of climbers of one height are longer or shorter: about two standard
# deviations (0.028 of the ratio in 1,465 children; Mishra, Mondal and Mondal, "Estimation of height
# from arm span", Journal of Clinical and Diagnostic Research 11, 2017).
ARMS: Final = 0.05

# Whether climbers of a height reach the top: all of them, some by their arm span, or none.
Reached: TypeAlias = Literal["yes", "depends", "no"]


def reached_by_arms(route: Route, holds: Sequence[Hold], unit: float) -> tuple[Reached, ...] | None:
    """Return for each of `HEIGHTS` whether it reaches the top, with arms of any usual length; None
    if the route is no climb.

    Parameters
    ----------
    holds : all holds of the wall. unit : scan units per metre.
    """
    climb = climb_of(route, on_route(route, holds, unit), unit)
    if climb is None:
        return None
    found: list[Reached] = []
    for height in HEIGHTS:
        short, long = (
            _moves_to_top(climb, Body(height, height * arms)) is not None
            for arms in (1 - ARMS, 1 + ARMS)
        )
        found.append("yes" if short and long else "depends" if short or long else "no")
    return tuple(found)


def reaching_heights(route: Route, holds: Sequence[Hold], unit: float) -> dict[float, float] | None:
    """Return those of `HEIGHTS` for which there are moves to the top, each with the longest reach
    on its way in metres (`longest_reach`); None if the route is no climb.

    Parameters
    ----------
    holds : all holds of the wall. unit : scan units per metre.
    """
    climb = climb_of(route, on_route(route, holds, unit), unit)
    if climb is None:
        return None
    found = {height: _moves_to_top(climb, Body(height)) for height in HEIGHTS}
    return {
        height: longest_reach(climb, moves) for height, moves in found.items() if moves is not None
    }


def reached_of(
    heights: Sequence[float], route: Route, holds: Sequence[Hold], unit: float
) -> list[float]:
    """Return the first of these heights, as many as reach the top before one does not.

    Parameters
    ----------
    heights : of climbers, in metres. holds : all holds of the wall. unit : scan units per metre.
    """
    climb = climb_of(route, on_route(route, holds, unit), unit)
    if climb is None:
        return []
    return list(takewhile(lambda height: _moves_to_top(climb, Body(height)) is not None, heights))


def _moves_to_top(climb: Climb, body: Body) -> Moves | None:
    moves = find_sequence(climb, body)
    return moves if moves is not None and moves.reached else None
