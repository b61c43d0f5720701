"""Lens distortion inside numba kernels; the formulas of `core.camera` for one point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.kernels import kernel

__all__ = ["distort", "lens_of"]


def lens_of(camera: Camera) -> NDArray[np.float64]:
    """What `distort` needs to know of a camera.

    Returns
    -------
    (14,) float64: kind (0 pinhole, 1 polynomial, 2 fisheye), fx, fy, cx, cy, then k1, k2, p1,
    p2, k3, k4, k5, k6 (fisheye: k1, k2, k3, k4), then one spare. The radial models are special
    cases of the full OpenCV one.
    """
    lens = np.zeros(14)
    lens[1:5] = camera.fx, camera.fy, camera.cx, camera.cy
    k = camera.distortion
    lens[5 : 5 + len(k)] = k
    if not camera.is_pinhole:
        lens[0] = 2.0 if camera.model == "OPENCV_FISHEYE" else 1.0
    return lens


@kernel
def distort(u, v, lens):  # type: ignore[no-untyped-def]
    """Pixel of the direction (u, v, 1) in the camera frame."""
    kind = lens[0]
    if kind == 1.0:
        k1, k2, p1, p2, k3, k4, k5, k6 = lens[5:13]
        r2 = u * u + v * v
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        radial /= 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        du = 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
        dv = 2 * p2 * u * v + p1 * (r2 + 2 * v * v)
        u, v = u * radial + du, v * radial + dv
    elif kind == 2.0:
        radius = np.sqrt(u * u + v * v)
        if radius > 1e-12:
            theta = np.arctan(radius)
            t2 = theta * theta
            polynomial = 1 + t2 * (lens[5] + t2 * (lens[6] + t2 * (lens[7] + t2 * lens[8])))
            factor = theta * polynomial / radius
            u, v = u * factor, v * factor
    return u * lens[1] + lens[3], v * lens[2] + lens[4]
