"""A photo's depth map, as every step of the embedded stereo hands it on, and its way elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.kernels import kernel

__all__ = ["DepthMap", "intrinsics", "seen_from"]

Floats = NDArray[np.float64]


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


def intrinsics(view: View) -> Floats:
    """(4,) fx, fy, cx, cy of a pinhole view, pixels."""
    camera = view.camera
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy])


@kernel
def seen_from(
    x: int, y: int, z: float, here: Floats, there: Floats, there_from_here: Floats
) -> tuple[float, float, float]:
    """Where another photo sees what lies at a depth in a pixel of this one.

    Parameters
    ----------
    x, y : the pixel; its middle is meant.
    z : z-depth in this photo's camera frame.
    here, there : (4,) intrinsics of both.
    there_from_here : (3, 4) between the camera frames.

    Returns
    -------
    u, v : pixels in the other photo; nan where it looks away.
    depth : z-depth there; not above 0 where it looks away.
    """
    px = (x + 0.5 - here[2]) / here[0] * z
    py = (y + 0.5 - here[3]) / here[1] * z
    m = there_from_here
    depth = m[2, 0] * px + m[2, 1] * py + m[2, 2] * z + m[2, 3]
    if depth <= 0.0:
        return np.nan, np.nan, depth
    u = (m[0, 0] * px + m[0, 1] * py + m[0, 2] * z + m[0, 3]) / depth * there[0] + there[2]
    v = (m[1, 0] * px + m[1, 1] * py + m[1, 2] * z + m[1, 3]) / depth * there[1] + there[3]
    return u, v, depth
