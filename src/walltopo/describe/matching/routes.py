"""Match the routes of a new scan to the current routes, by their holds.

The holds of both scans are matched in the wall's frame (`walltopo.describe.matching.holds`). Two
routes are the same if they share most of their holds, in the same colour. Routes are paired by the
assignment of greatest total agreement (H. W. Kuhn, "The Hungarian method for the assignment
problem", 1955).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

import numpy as np
from scipy.optimize import linear_sum_assignment

from walltopo.describe.matching.holds import match_holds
from walltopo.scans.holds import UNKNOWN, Hold

Key = TypeVar("Key")

# Minimum share of common holds among all holds that either route has.
_MIN_AGREEMENT: Final = 0.5
# A hold at a larger distance (metres) from its old position counts as moved.
_MIN_SHIFT: Final = 0.05
# Colours (sRGB, 0 to 255) at a smaller distance are one paint, whatever their names.
_SAME_PAINT: Final = 40.0


class RouteStatus(StrEnum):
    """The change of a route between two scans."""

    KEPT = "kept"
    CHANGED = "changed"
    NEW = "new"
    STRIPPED = "stripped"


@dataclass(frozen=True)
class RouteMatch(Generic[Key]):
    """One row of the table that a setter confirms.

    Parameters
    ----------
    route : the current route, or None for a new one.
    number : number of the route in the new scan, or None for a stripped one.
    added, removed : holds that only the new or only the old scan has.
    moved : holds of the new scan that changed position.
    """

    status: RouteStatus
    route: Key | None
    number: int | None
    added: tuple[int, ...] = ()
    removed: tuple[int, ...] = ()
    moved: tuple[int, ...] = ()


def compare_routes(
    old_routes: Mapping[Key, Sequence[int]],
    old_holds: Sequence[Hold],
    new_routes: Mapping[int, Sequence[int]],
    new_holds: Sequence[Hold],
    unit: float = 1.0,
) -> list[RouteMatch[Key]]:
    """Return a row for every route of both scans: those of the new scan in order, then the rest.

    Parameters
    ----------
    old_routes, new_routes : the holds of each route; unit : scan units per metre.
    """
    before = {hold.id: hold for hold in old_holds}
    after = {hold.id: hold for hold in new_holds}
    same = {
        old: new
        for old, new in match_holds(old_holds, new_holds, unit).items()
        if same_paint(before[old], after[new])
    }
    moved = {
        old
        for old, new in same.items()
        if np.linalg.norm(np.subtract(before[old].position, after[new].position))
        > _MIN_SHIFT * unit
    }
    keys, numbers = list(old_routes), list(new_routes)
    agreement = np.array(
        [[_shared_hold_ratio(old_routes[k], new_routes[n], same) for n in numbers] for k in keys]
    ).reshape(len(keys), len(numbers))
    agreement[agreement < _MIN_AGREEMENT] = 0.0
    pairs = zip(*linear_sum_assignment(-agreement), strict=True)
    mine = {numbers[b]: keys[a] for a, b in pairs if agreement[a, b] > 0.0}
    matches: list[RouteMatch[Key]] = []
    for number in numbers:
        if number not in mine:
            matches.append(RouteMatch(RouteStatus.NEW, None, number))
            continue
        key = mine[number]
        matches.append(_matched_row(key, number, old_routes[key], new_routes[number], same, moved))
    kept = set(mine.values())
    return matches + [
        RouteMatch(RouteStatus.STRIPPED, key, None) for key in keys if key not in kept
    ]


def same_paint(old: Hold, new: Hold) -> bool:
    """Return whether two holds may have the same paint: equal or similar, or one is unknown."""
    if old.colour == new.colour or UNKNOWN in (old.colour, new.colour):
        return True
    return float(np.linalg.norm(np.subtract(old.colour_rgb, new.colour_rgb))) < _SAME_PAINT


def _shared_hold_ratio(old: Sequence[int], new: Sequence[int], same: Mapping[int, int]) -> float:
    """Return the shared holds as a share of all holds that either route has."""
    shared = len({same[hold] for hold in old if hold in same} & set(new))
    return shared / max(1, len(set(old)) + len(set(new)) - shared)


def _matched_row(
    key: Key,
    number: int,
    old: Sequence[int],
    new: Sequence[int],
    same: Mapping[int, int],
    moved: Collection[int],
) -> RouteMatch[Key]:
    """Return the row of a route in both scans; `moved` has old holds that changed position."""
    shared = {hold: same[hold] for hold in old if same.get(hold) in set(new)}
    removed = tuple(sorted(set(old) - set(shared)))
    added = tuple(sorted(set(new) - set(shared.values())))
    shifted = tuple(sorted(b for a, b in shared.items() if a in moved))
    status = RouteStatus.CHANGED if removed or added or shifted else RouteStatus.KEPT
    return RouteMatch(status, key, number, added, removed, shifted)
