"""What a climber wants of a route: order, start, top, footholds, ambiguous holds, facts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import Hold
from walltopo.scans.bounds import Rgb
from walltopo.scans.edits import RoleName
from walltopo.scans.routes import Ambiguous, Route

__all__ = ["STRONGEST", "colour_of", "describe_route", "memberships", "route_facts", "usual_size"]

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


def usual_size(holds: Sequence[Hold]) -> float:
    """The median size of a scan's holds, by which a foothold is small; 0 where none is known."""
    sizes = [hold.size for hold in holds if hold.role == "hold" and hold.size > 0]
    return float(np.median(sizes)) if sizes else 0.0


def colour_of(holds: Sequence[Hold]) -> tuple[str, Rgb]:
    """The colour that most of the holds have, and what it looks like: the median of theirs."""
    names = [hold.colour for hold in holds]
    name = max(sorted(set(names)), key=names.count)
    paints = [hold.colour_rgb for hold in holds if hold.colour == name]
    red, green, blue = np.median(paints, axis=0).round().astype(int).tolist()
    return name, (red, green, blue)


def describe_route(
    number: int,
    holds: Sequence[Hold],
    usual: float,
    ambiguous: Mapping[int, Mapping[int, float]] | None = None,
    roles: Mapping[int, RoleName] | None = None,
) -> Route:
    """The route of a group of holds: ordered, with its start, top, footholds and facts.

    Footholds are holds typed so, or of unknown type and far smaller than the usual hold;
    where a route has nothing else, all its holds count as hand holds.

    Parameters
    ----------
    usual : `usual_size` of the scan.
    ambiguous : hold id to its probability by route id.
    roles : what a setter says of a hold, also of volumes, which are not among `holds`. Each entry
        is about its own hold: what is found for the others stays.
    """
    said = roles or {}
    ordered = bottom_to_top(holds)
    found = _found_roles(ordered, usual)
    known = [hold.id for hold in ordered]
    known += [hold for hold in said if hold not in known]

    def having(role: RoleName) -> tuple[int, ...]:
        return tuple(
            hold for hold in known if said.get(hold) == role or hold in found[role] - said.keys()
        )

    feet = having("foot")
    hands = [hold for hold in ordered if hold.id not in feet] or ordered
    colour, rgb = colour_of(ordered)
    return Route(
        id=number,
        colour=colour,
        colour_rgb=rgb,
        holds=tuple(hold.id for hold in ordered),
        start=having("start"),
        top=having("top"),
        zone=having("zone"),
        footholds=feet,
        ambiguous=tuple(
            Ambiguous(hold, {str(route): round(p, 3) for route, p in shares.items()})
            for hold, shares in (ambiguous or {}).items()
        ),
        **route_facts(ordered, hands),
    )


def _found_roles(ordered: Sequence[Hold], usual: float) -> dict[RoleName, set[int]]:
    """Ids of start, top and footholds of holds from bottom to top."""
    feet = {hold.id for hold in ordered if _is_foothold(hold, usual)}
    hands = [hold for hold in ordered if hold.id not in feet]
    if not hands:
        feet, hands = set(), list(ordered)
    return {"start": set(_start(hands)), "top": {hands[-1].id}, "foot": feet, "zone": set()}
