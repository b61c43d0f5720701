"""How long a metre is in a scan that has no scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walltopo.scans.folder import ScanFolder, read_json
from walltopo.scans.records import Hold

__all__ = ["is_metric", "unit_of", "unit_of_sizes"]


def is_metric(scan: ScanFolder) -> bool:
    """Whether lengths of a scan are metres; a mesh without a `scale.json` is taken to be so."""
    return bool(read_json(scan.scale)["metric"]) if scan.scale.is_file() else True


def unit_of(holds: Sequence[Hold], metric: bool, typical_hold: float) -> float:
    """How many scan units a metre is: 1 for scaled scans.

    Without a scale the size of holds is the ruler: the median hold of a gym is about
    `typical_hold` long, so the unit is the median size of the scan's holds over that.
    """
    sizes = [hold.size_m for hold in holds if hold.role == "hold"]
    return unit_of_sizes(sizes, metric, typical_hold)


def unit_of_sizes(sizes: Sequence[float], metric: bool, typical_hold: float) -> float:
    """The same from the sizes of the holds alone, in scan units."""
    known = [size for size in sizes if size > 0]
    if metric or not known:
        return 1.0
    return float(np.median(known)) / typical_hold
