"""Which colour is that of the jugs to climb down by, where nobody has said so."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec.structs import replace

from walltopo.geometry.graphs import components
from walltopo.scans.attributes import Hold

# A route has footholds, small holds or other types; these do not. Chosen on generated gyms by
# `python -m walltopo_lab.benchmarks.routes_downclimb choose`.
LEAST_HOLDS = 2  # a single jug of a colour tells nothing
JUGS = 0.25  # share that must be typed jug; the rest may be of unknown type
OTHERS = 0.34  # share of the typed ones that may be of another type: types are wrong now and then
LARGE = 0.8  # times the wall's median size: their own median
ALONE = 4  # more than so many in reach of each other are a route
REACH = 1.6  # metres, along the floor and a fifth of the height
FLATTEN = 0.2


def _largest_cluster(holds: Sequence[Hold], unit: float) -> int:
    """Holds of the largest group that hangs together by steps of `REACH`."""
    points = np.array([hold.position for hold in holds]) / unit * [1, 1, FLATTEN]
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    return int(np.bincount(components(len(holds), *np.nonzero(apart < REACH))).max())


def downclimb_colours(holds: Sequence[Hold], unit: float) -> list[str]:
    """Colours whose holds are large jugs, few and scattered; sorted.

    Nothing where types are unknown: then no colour has jugs enough.

    Parameters
    ----------
    holds : all of a wall, with types.
    unit : scan units a metre.
    """
    climbed = [hold for hold in holds if hold.kind == "hold" and hold.colour != "unknown"]
    sizes = [hold.size for hold in climbed if hold.size > 0]
    if not sizes:
        return []
    usual = float(np.median(sizes))
    found = []
    for colour in sorted({hold.colour for hold in climbed}):
        own = [hold for hold in climbed if hold.colour == colour]
        types = [hold.type for hold in own]
        jugs, typed = types.count("jug"), len(types) - types.count("unknown")
        if len(own) < LEAST_HOLDS or jugs < JUGS * len(own) or typed - jugs > OTHERS * typed:
            continue
        large = float(np.median([hold.size for hold in own])) >= LARGE * usual
        if large and _largest_cluster(own, unit) <= ALONE:
            found.append(colour)
    return found


def with_downclimbs(holds: Sequence[Hold], unit: float) -> tuple[list[Hold], list[str]]:
    """The holds with the role that `downclimb_colours` gives them, and those colours."""
    colours = downclimb_colours(holds, unit)
    changed = [
        replace(hold, role="downclimb") if hold.role == "hold" and hold.colour in colours else hold
        for hold in holds
    ]
    return changed, colours
