"""Which route of a new scan is which route that hangs already: by its holds.

The holds of both scans are matched in the wall's frame
(`walltopo.describe.matching.holds`: position,
normal, size and kind, one-to-one of least cost). Two routes are the same if they share most of
their holds, in the same colour; who goes with whom is the assignment of greatest agreement
(H. W. Kuhn, "The Hungarian method for the assignment problem", 1955).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

import numpy as np
from scipy.optimize import linear_sum_assignment

from walltopo.describe.matching.holds import match_holds
from walltopo.scans.attributes import UNKNOWN, Hold

Key = TypeVar("Key")

# Of all holds that either has, so many at least are in both.
_LEAST_AGREEMENT: Final = 0.5
# A hold that turned up so far from where it was has been moved, in metres.
_MOVED: Final = 0.05
# Colours (sRGB, 0 to 255) that are less apart are one paint, whatever their names.
_SHADE: Final = 40.0


class Fate(StrEnum):
    """What became of a route."""

    KEPT = "kept"
    CHANGED = "changed"
    NEW = "new"
    STRIPPED = "stripped"


@dataclass(frozen=True)
class Line(Generic[Key]):
    """One line of the table that a setter confirms.

    Parameters
    ----------
    route : the route that hangs already; None for a new one.
    number : of the route in the new scan; None for one that is stripped.
    came, went : holds of the new and of the old scan that are on one side only.
    moved : holds of the new scan that are not quite where they were.
    """

    fate: Fate
    route: Key | None
    number: int | None
    came: tuple[int, ...] = ()
    went: tuple[int, ...] = ()
    moved: tuple[int, ...] = ()


def compare(
    old_routes: Mapping[Key, Sequence[int]],
    old_holds: Sequence[Hold],
    new_routes: Mapping[int, Sequence[int]],
    new_holds: Sequence[Hold],
    unit: float = 1.0,
) -> list[Line[Key]]:
    """Every route of both scans in one line: those of the new scan in its order, then the rest.

    Parameters
    ----------
    old_routes, new_routes : the holds of each; unit : scan units a metre.
    """
    before = {hold.id: hold for hold in old_holds}
    after = {hold.id: hold for hold in new_holds}
    same = {
        old: new
        for old, new in match_holds(old_holds, new_holds, unit).items()
        if same_paint(before[old], after[new])
    }
    keys, numbers = list(old_routes), list(new_routes)
    agreement = np.array(
        [[_agreement(old_routes[k], new_routes[n], same) for n in numbers] for k in keys]
    ).reshape(len(keys), len(numbers))
    agreement[agreement < _LEAST_AGREEMENT] = 0.0
    pairs = zip(*linear_sum_assignment(-agreement), strict=True)
    mine = {numbers[b]: keys[a] for a, b in pairs if agreement[a, b] > 0.0}
    lines: list[Line[Key]] = []
    for number in numbers:
        if number not in mine:
            lines.append(Line(Fate.NEW, None, number))
            continue
        key = mine[number]
        lines.append(_line(key, number, old_routes[key], new_routes[number], same, before, after,
                           _MOVED * unit))  # fmt: skip
    kept = set(mine.values())
    return lines + [Line(Fate.STRIPPED, key, None) for key in keys if key not in kept]


def same_paint(old: Hold, new: Hold) -> bool:
    """Not of another colour, as far as it was seen; a shade between two names may bear either."""
    if old.colour == new.colour or UNKNOWN in (old.colour, new.colour):
        return True
    return float(np.linalg.norm(np.subtract(old.colour_rgb, new.colour_rgb))) < _SHADE


def _agreement(old: Sequence[int], new: Sequence[int], same: Mapping[int, int]) -> float:
    """Shared holds as a share of all that either has."""
    shared = len({same[hold] for hold in old if hold in same} & set(new))
    return shared / max(1, len(set(old)) + len(set(new)) - shared)


def _line(
    key: Key, number: int, old: Sequence[int], new: Sequence[int], same: Mapping[int, int],
    before: Mapping[int, Hold], after: Mapping[int, Hold], moved_beyond: float,
) -> Line[Key]:  # fmt: skip
    shared = {hold: same[hold] for hold in old if same.get(hold) in set(new)}
    went = tuple(sorted(set(old) - set(shared)))
    came = tuple(sorted(set(new) - set(shared.values())))
    moved = tuple(
        sorted(
            b
            for a, b in shared.items()
            if np.linalg.norm(np.subtract(before[a].position, after[b].position)) > moved_beyond
        )
    )
    fate = Fate.CHANGED if went or came or moved else Fate.KEPT
    return Line(fate, key, number, came, went, moved)
