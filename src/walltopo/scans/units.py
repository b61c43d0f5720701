"""How long a metre is in a scan that has no scale."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from walltopo.scans.attributes import Hold

__all__ = ["unit_of", "unit_of_sizes"]


def unit_of(holds: Sequence[Hold], metric: bool, typical_hold: float) -> float:
    """How many scan units a metre is: 1 for scaled scans.

    Without a scale the size of holds is the ruler: the median hold of a gym is about
    `typical_hold` long, so the unit is the median size of the scan's holds over that.
    """
    return unit_of_sizes((h.size for h in holds if h.role == "hold"), metric, typical_hold)


def unit_of_sizes(sizes: Iterable[float], metric: bool, typical_hold: float) -> float:
    """The same from the sizes of the holds alone, in scan units."""
    known = [size for size in sizes if size > 0]
    if metric or not known:
        return 1.0
    return float(np.median(known)) / typical_hold
