"""What a climber wants of a route: order, start, top, footholds, ambiguous holds, facts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import Hold
from walltopo.scans.routes import Ambiguous, Route

__all__ = ["describe_route", "memberships", "route_facts"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FOOT_SHARE = 0.55  # below this share of the scan's median hold size a hold is for feet
START_STEP = 0.35  # two start holds differ in height by at most this share of the route
START_SPREAD = 1.0  # and are this many typical moves apart at most
STRONGEST = 3  # similarities that speak for a hold's membership of a route


def _is_foothold(hold: Hold, median_size: float) -> bool:
    return hold.type == "foothold" or (
        hold.type == "unknown" and 0 < hold.size < FOOT_SHARE * median_size
    )


def bottom_to_top(holds: Sequence[Hold]) -> list[Hold]:
    """Holds by height, ties by id."""
    return sorted(holds, key=lambda hold: (hold.position[2], hold.id))


def _start(hands: Sequence[Hold]) -> tuple[int, ...]:
    """The lowest hand hold, and the next one if both hands fit on the pair.

    Both hands start together where the second hold is about as high as the first (within a
    third of the route) and no farther from it than a typical move.
    """
    if len(hands) < 3:
        return tuple(hold.id for hold in hands[:1])
    points = np.array([hold.position for hold in hands])
    moves = np.linalg.norm(np.diff(points, axis=0), axis=1)
    rise = points[1, 2] - points[0, 2]
    height = points[-1, 2] - points[0, 2]
    typical = float(np.median(moves))
    if rise <= min(START_STEP * height, 0.5 * typical) and moves[0] <= START_SPREAD * typical:
        return hands[0].id, hands[1].id
    return (hands[0].id,)


def route_facts(holds: Sequence[Hold], hands: Sequence[Hold]) -> dict[str, Any]:
    """Figures of a route.

    Returns
    -------
    length : polyline through the hand holds from bottom to top.
    steepness_deg : mean wall angle under its holds.
    steepness_profile : [height above the lowest hold in metres, degrees] per hand hold.
    largest_move : longest distance from a hand hold to the nearest lower one.
    holds_by_type : type to count.
    """
    points = np.array([hold.position for hold in hands]).reshape(-1, 3)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    reach = [
        float(np.linalg.norm(points[:k] - points[k], axis=1).min()) for k in range(1, len(points))
    ]
    base = min(hold.position[2] for hold in holds)
    return {
        "length": round(float(steps.sum()), 3),
        "steepness_deg": round(float(np.mean([hold.steepness_deg for hold in holds])), 1),
        "steepness_profile": tuple(
            (round(hold.position[2] - base, 3), round(hold.steepness_deg, 1)) for hold in hands
        ),
        "largest_move": round(max(reach, default=0.0), 3),
        "holds_by_type": dict(sorted(Counter(hold.type for hold in holds).items())),
    }


def memberships(links: Floats, group: Ints) -> Floats:
    """How well each hold would fit each group.

    Parameters
    ----------
    links : (n, n) similarity in [0, 1]; group : (n,) group numbers, -1 = none.

    Returns
    -------
    (n, groups) float64, rows sum to 1 (or 0 for holds without any link): squared mean of a
    hold's strongest links into each group, normalised. Squared, so that a hold in the midst
    of its route is not called ambiguous because of a far neighbour.
    """
    count = int(group.max(initial=-1)) + 1
    fit = np.zeros((len(group), count))
    for number in range(count):
        columns = links[:, group == number]
        kept = min(STRONGEST, columns.shape[1])
        fit[:, number] = (np.sort(columns, axis=1)[:, -kept:].sum(axis=1) / STRONGEST) ** 2
    total = fit.sum(axis=1, keepdims=True)
    return np.divide(fit, total, out=np.zeros_like(fit), where=total > 0)


def describe_route(
    number: int,
    colour: str,
    holds: Sequence[Hold],
    median_size: float,
    ambiguous: Mapping[int, Mapping[int, float]],
    name: str = "",
) -> Route:
    """The route of a group of holds: ordered, with its start, top, footholds and facts.

    Footholds are holds typed so, or of unknown type and far smaller than the median hold;
    where a route has nothing else, all its holds count as hand holds.
    """
    ordered = bottom_to_top(holds)
    feet = [hold for hold in ordered if _is_foothold(hold, median_size)]
    hands = [hold for hold in ordered if hold not in feet]
    if not hands:
        feet, hands = [], ordered
    return Route(
        id=number,
        colour=colour,
        holds=tuple(hold.id for hold in ordered),
        name=name,
        start=_start(hands),
        top=(hands[-1].id,),
        footholds=tuple(hold.id for hold in feet),
        ambiguous=tuple(
            Ambiguous(hold, {str(route): round(p, 3) for route, p in shares.items()})
            for hold, shares in ambiguous.items()
        ),
        **route_facts(ordered, hands),
    )
