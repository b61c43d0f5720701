"""Holds of a route in climbing order, hands and feet, ambiguous holds, figures of a route."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.describe.routes.start_and_top import (
    Wall,
    bottom_to_top,
    find_ends,
)
from walltopo.scans.attributes import Hold
from walltopo.scans.document import Rgb
from walltopo.scans.edits import RoleName
from walltopo.scans.routes import Ambiguous, Route

Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

STRONGEST = 3  # similarities that speak for a hold's membership of a route


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
    wall: Wall,
    ambiguous: Mapping[int, Mapping[int, float]] | None = None,
    roles: Mapping[int, RoleName] | None = None,
) -> Route:
    """The route of a group of holds: ordered, with its start, top, footholds and facts.

    Where a route has nothing but footholds, all its holds count as hand holds.

    Parameters
    ----------
    wall : what is usual on it (`ends.wall_of`).
    ambiguous : hold id to its probability by route id.
    roles : what a setter says of a hold, also of volumes, which are not among `holds`. Each entry
        is about its own hold: what is found for the others stays.
    """
    said = roles or {}
    ordered = bottom_to_top(holds)
    ends = find_ends(ordered, wall, ambiguous or {}, number)
    found: dict[RoleName, set[int]] = {
        "start": {hold.id for hold in ends.start},
        "top": {ends.top.id},
        "foot": {hold.id for hold in ends.feet},
        "zone": set(),
    }
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
        doubtful_start="" if "start" in said.values() else ends.start_doubt.reason,
        doubtful_top="" if "top" in said.values() else ends.top_doubt.reason,
        ambiguous=tuple(
            Ambiguous(hold, {str(route): round(p, 3) for route, p in shares.items()})
            for hold, shares in (ambiguous or {}).items()
        ),
        **route_facts(ordered, hands),
    )
