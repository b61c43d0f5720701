"""Vertices on the screen: pixel and inverse depth, in every camera model."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera

__all__ = ["screen_vertices", "valid_slope"]

Floats = NDArray[np.float64]


def screen_vertices(local: Floats, camera: Camera) -> Floats:
    """Pixels and 1/z of vertices given in the camera frame.

    Parameters
    ----------
    local : (V, 3) float, camera frame.

    Returns
    -------
    (V, 3) float64: x and y in pixels, 1/z; zeros (so 1/z = 0) where the vertex is behind the
    camera or so far off its axis that the distortion model folds over.
    """
    z = local[:, 2]
    ahead = z > 0
    inverse = np.where(ahead, 1.0 / np.where(ahead, z, 1.0), 0.0)
    screen = np.zeros_like(local)
    screen[:, 2] = inverse
    if camera.is_pinhole:
        screen[:, 0] = local[:, 0] * inverse * camera.fx + camera.cx
        screen[:, 1] = local[:, 1] * inverse * camera.fy + camera.cy
        return screen
    slope2 = (local[:, 0] ** 2 + local[:, 1] ** 2) * inverse**2
    good = np.flatnonzero(ahead & (slope2 < valid_slope(camera) ** 2))
    screen[:, 2] = 0.0
    screen[good, :2] = camera.project(local[good])
    screen[good, 2] = inverse[good]
    return screen


@lru_cache(maxsize=64)
def valid_slope(camera: Camera) -> float:
    """Largest sqrt(x² + y²) / z up to which the distortion model is one-to-one.

    Polynomial distortion with a negative term turns back at some angle: points beyond would be
    drawn inside the photo. Found by walking outwards along 16 directions; infinite for models
    that never turn back within 20 times the focal length.
    """
    slopes = np.linspace(0.0, 20.0, 4001)
    limit = np.inf
    for angle in np.linspace(0.0, 2 * np.pi, 16, endpoint=False):
        ray = np.array([np.cos(angle), np.sin(angle)])
        points = np.column_stack([slopes[:, None] * ray, np.ones(len(slopes))])
        outwards = (camera.project(points) - [camera.cx, camera.cy]) @ ray
        folds = np.flatnonzero(np.diff(outwards) <= 0)
        if len(folds):
            limit = min(limit, float(slopes[folds[0]]))
    return limit
