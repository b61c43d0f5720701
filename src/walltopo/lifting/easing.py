"""How much a view that is far away still counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["ease"]

Floats = NDArray[np.float64]


def ease(distance: Floats, visibility_distance: float, power: float) -> Floats:
    """Weight of evidence at a distance, falling from 1 at the camera to 0 at the limit.

    Parameters
    ----------
    distance : (n,) float, from the camera centre, in the unit of `visibility_distance`.
    power : in [-1, 1]. The formula is (1 - x) ** (4 ** power) with x the share of the limit:
        0 is linear, -1 stays high until close to the limit, 1 falls early.

    Returns
    -------
    (n,) float in [0, 1]; 0 beyond the limit.
    """
    share = np.clip(1.0 - np.asarray(distance) / visibility_distance, 0.0, 1.0)
    return share ** (4.0**power)
