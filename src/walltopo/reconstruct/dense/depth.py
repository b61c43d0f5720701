"""A photo's depth map, as every step of the embedded stereo hands it on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View

__all__ = ["DepthMap"]


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Depths of one photo and how far to trust them.

    Parameters
    ----------
    depth : (H, W) float32 z-depth in the view's camera frame, 0 = unknown.
    weight : (H, W) float32, inverse variance times edge squared, 0 where no depth.
    pairs : (H, W) uint8, stereo pairs that agree on the depth.
    view : the pinhole view of all three.
    """

    depth: NDArray[np.float32]
    weight: NDArray[np.float32]
    pairs: NDArray[np.uint8]
    view: View
