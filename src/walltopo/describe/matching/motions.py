"""Find the holds that turned or moved between two scans of one wall.

A hold that works loose turns about its bolt; one that is bolted on again sits a little elsewhere.
Both scans are rendered straight onto each hold, and the two patches are compared
(`walltopo.describe.matching.turn`). Motions are relative to the holds around, so that a small
error between the frames of both scans counts for nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress, Silent
from walltopo.core.parallel import map_ahead
from walltopo.describe.matching.holds import SIZE_RATIO, match_holds
from walltopo.describe.matching.patches import TexturedWall, Window, patch_of
from walltopo.describe.matching.turn import Fit, fit_patches
from walltopo.scans.holds import Hold

Floats = NDArray[np.float64]

# Limits of what counts as a motion, chosen on two generated gyms (`easy` 1, `oldschool-dark` 2) and
# the same after wear: none of 141 untouched holds counts, 27 of 35 that turned by 15 degrees do.
_TURN_DEG: Final = 8.0
_SHIFT_M: Final = 0.008
_EXPLAINED: Final = 2.0
_GAIN: Final = 1.06

_NEAR_M: Final = 0.08  # between the places of one hold that moved
_REACH_M: Final = 0.07  # largest shift that is tried
_STILL_M: Final = 0.006  # largest shift that counts as none
_NEIGHBOURS_M: Final = 2.0  # distance of the holds whose median displacement is the frames' error


@dataclass(frozen=True)
class Motion:
    """How a hold differs from itself in an older scan.

    Parameters
    ----------
    turn : degrees, counter-clockwise seen from the climber. shift : (right, up) metres.
    error : mean squared difference of the patches after turn and shift; about 1 is usual for an
        untouched hold. still_error : the same without turn and shift.
    """

    turn: float
    shift: tuple[float, float]
    error: float
    still_error: float

    @property
    def is_turned(self) -> bool:
        """Return whether the photos show that the hold turned."""
        return abs(self.turn) >= _TURN_DEG and self._explains()

    @property
    def is_moved(self) -> bool:
        """Return whether the photos show that the hold sits elsewhere, but did not turn."""
        return not self.is_turned and self.distance >= _SHIFT_M and self._explains()

    @property
    def distance(self) -> float:
        """Return the length of the shift, metres."""
        return float(np.hypot(*self.shift))

    def _explains(self) -> bool:
        """Return whether turn and shift explain the new scan, and standing still does not."""
        return self.error < _EXPLAINED and self.still_error > _GAIN * self.error


Motions = Mapping[tuple[int, int], Motion]  # by old id and new id


def find_motions(
    old: TexturedWall,
    new: TexturedWall,
    old_holds: Sequence[Hold],
    new_holds: Sequence[Hold],
    progress: Progress | None = None,
) -> Motions:
    """Return the motion of each hold that both scans may show.

    Both scans share a frame, up to a drift of some 20 cm.
    """
    report = progress or Silent()
    before = {hold.id: hold for hold in old_holds}
    after = {hold.id: hold for hold in new_holds}
    same = match_holds(old_holds, new_holds, old.unit)
    drift = _Drift.of([(before[a], after[b]) for a, b in same.items()], old.unit)
    pairs = [*same.items(), *_near_pairs(before, after, same, old.unit)]

    def measured(pair: tuple[int, int]) -> tuple[tuple[int, int], Motion | None]:
        hold = before[pair[0]]
        window = Window.around(hold, old.unit)
        away = drift.at(window.centre)
        moved = replace(window, centre=window.centre + away)
        views = patch_of(old, window, pair[0]), patch_of(new, moved, pair[1])
        cell = window.cell / old.unit
        found = fit_patches(*views, reach=round(_REACH_M / cell), still=int(_STILL_M / cell))
        return pair, None if found is None else _motion_in_metres(*found, cell)

    report.step("comparing holds", len(pairs))
    motions = {}
    for pair, motion in map_ahead(measured, pairs):
        report.advance()
        if motion is not None:
            motions[pair] = motion
    return motions


def _motion_in_metres(best: Fit, still: Fit, cell: float) -> Motion:
    """Return a fit in metres; cell in metres."""
    right, up = best.shift
    return Motion(best.turn, (right * cell, up * cell), best.error, still.error)


def _near_pairs(
    before: Mapping[int, Hold], after: Mapping[int, Hold], same: Mapping[int, int], unit: float
) -> Iterator[tuple[int, int]]:
    """Yield pairs of holds without a match that may be one hold that moved, the nearest first."""
    lost = [hold for hold in before.values() if hold.id not in same and hold.kind == "hold"]
    matched = set(same.values())
    found = [hold for hold in after.values() if hold.id not in matched]
    near = [
        (distance, a.id, b.id)
        for a in lost
        for b in found
        if (distance := float(np.linalg.norm(np.subtract(a.position, b.position)))) < _NEAR_M * unit
        and a.kind == b.kind
        and max(a.size, b.size) < SIZE_RATIO * max(min(a.size, b.size), 1e-9)
    ]
    taken_old, taken_new = set[int](), set[int]()
    for _, a_id, b_id in sorted(near):
        if a_id not in taken_old and b_id not in taken_new:
            taken_old.add(a_id)
            taken_new.add(b_id)
            yield a_id, b_id


@dataclass(frozen=True, eq=False)
class _Drift:
    """The displacement of the holds that stayed: `places` (n, 3), `away` (n, 3), scan units."""

    places: Floats
    away: Floats
    reach: float

    @classmethod
    def of(cls, pairs: Sequence[tuple[Hold, Hold]], unit: float) -> _Drift:
        places = np.array([old.position for old, _ in pairs]).reshape(-1, 3)
        moved = np.array([new.position for _, new in pairs]).reshape(-1, 3)
        return cls(places, moved - places, _NEIGHBOURS_M * unit)

    def at(self, place: Floats) -> Floats:
        """Return the median displacement around a place; 0 without holds around."""
        near = np.linalg.norm(self.places - place, axis=1) < self.reach
        return np.median(self.away[near], axis=0) if near.any() else np.zeros(3)
