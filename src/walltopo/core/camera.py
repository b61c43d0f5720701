"""A camera: image size and intrinsics, in COLMAP's models and pixel convention.

Pixel (0, 0) is the corner of the top-left pixel, its centre is at (0.5, 0.5).
Source of the distortion formulas: COLMAP, "Camera Models" (documentation) and
OpenCV's calib3d for the OPENCV models.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core.errors import InputError
from walltopo.core.mask import check_picture_size

Floats = NDArray[np.float64]

# How many parameters each model has, in COLMAP's order.
CAMERA_MODELS = {
    "SIMPLE_PINHOLE": 3,  # f, cx, cy
    "PINHOLE": 4,  # fx, fy, cx, cy
    "SIMPLE_RADIAL": 4,  # f, cx, cy, k1
    "RADIAL": 5,  # f, cx, cy, k1, k2
    "OPENCV": 8,  # fx, fy, cx, cy, k1, k2, p1, p2
    "FULL_OPENCV": 12,  # fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6
    "OPENCV_FISHEYE": 8,  # fx, fy, cx, cy, k1, k2, k3, k4
}
_ONE_FOCAL = {"SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"}


def _radial(uv: Floats, k: tuple[float, ...]) -> Floats:
    r2 = (uv**2).sum(axis=-1, keepdims=True)
    factor = np.ones_like(r2)
    for power, coefficient in enumerate(k, start=1):
        factor = factor + coefficient * r2**power
    return uv * factor


def _opencv(uv: Floats, k: tuple[float, ...]) -> Floats:
    k1, k2, p1, p2, *higher = k
    k3, k4, k5, k6 = higher or (0.0, 0.0, 0.0, 0.0)
    u, v = uv[..., 0], uv[..., 1]
    r2 = u * u + v * v
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    du = 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
    dv = 2 * p2 * u * v + p1 * (r2 + 2 * v * v)
    return np.stack([u * radial + du, v * radial + dv], axis=-1)


def _fisheye(uv: Floats, k: tuple[float, ...]) -> Floats:
    radius = np.sqrt((uv**2).sum(axis=-1, keepdims=True))
    theta = np.arctan(radius)
    t2 = theta**2
    distorted = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))))
    small = radius < 1e-12
    return uv * np.where(small, 1.0, distorted / np.where(small, 1.0, radius))


_DISTORT: dict[str, Callable[[Floats, tuple[float, ...]], Floats]] = {
    "SIMPLE_RADIAL": _radial,
    "RADIAL": _radial,
    "OPENCV": _opencv,
    "FULL_OPENCV": _opencv,
    "OPENCV_FISHEYE": _fisheye,
}


@dataclass(frozen=True)
class Camera:
    """Intrinsics of one camera.

    Parameters
    ----------
    model : a key of `CAMERA_MODELS` (COLMAP's names).
    width, height : image size in pixels.
    params : the model's parameters in COLMAP's order, pixels and pure numbers.

    Examples
    --------
    A point 2 m ahead and 1 m to the right:

    >>> camera = Camera("PINHOLE", 640, 480, (520.0, 520.0, 320.0, 240.0))
    >>> camera.project([1.0, 0.0, 2.0]).tolist()
    [580.0, 240.0]
    """

    model: str
    width: int
    height: int
    params: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.model not in CAMERA_MODELS:
            raise InputError(
                f"camera model {self.model!r} is not supported; "
                f"expected one of {', '.join(CAMERA_MODELS)}",
                "Undistort the photos first (COLMAP's image_undistorter).",
            )
        expected = CAMERA_MODELS[self.model]
        if len(self.params) != expected:
            raise InputError(
                f"camera model {self.model} takes {expected} parameters, got {len(self.params)}"
            )
        check_picture_size(self.width, self.height)
        if not np.isfinite(self.params).all() or self.fx <= 0 or self.fy <= 0:
            raise InputError(f"camera parameters must be finite with a focal > 0: {self.params}")

    @property
    def fx(self) -> float:
        return self.params[0]

    @property
    def fy(self) -> float:
        return self.params[0] if self.model in _ONE_FOCAL else self.params[1]

    @property
    def cx(self) -> float:
        return self.params[1] if self.model in _ONE_FOCAL else self.params[2]

    @property
    def cy(self) -> float:
        return self.params[2] if self.model in _ONE_FOCAL else self.params[3]

    @property
    def distortion(self) -> tuple[float, ...]:
        """The model's distortion coefficients, in COLMAP's order; empty for pinholes."""
        return self.params[3:] if self.model in _ONE_FOCAL else self.params[4:]

    @property
    def is_pinhole(self) -> bool:
        return not any(self.distortion)

    def matrix(self) -> Floats:
        """The (3, 3) calibration matrix K, without distortion."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=float)

    def pinhole(self) -> Camera:
        """The same camera without its distortion (what undistorted photos have)."""
        return Camera("PINHOLE", self.width, self.height, (self.fx, self.fy, self.cx, self.cy))

    def scaled(self, factor_x: float, factor_y: float | None = None) -> Camera:
        """The camera of the photo resized by the factors (sizes are rounded)."""
        fy = factor_x if factor_y is None else factor_y
        width, height = round(self.width * factor_x), round(self.height * fy)
        sx, sy = width / self.width, height / self.height
        params = list(self.params)
        if self.model in _ONE_FOCAL:
            params[0:3] = [params[0] * sx, params[1] * sx, params[2] * sy]
        else:
            params[0:4] = [params[0] * sx, params[1] * sy, params[2] * sx, params[3] * sy]
        return Camera(self.model, width, height, tuple(params))

    def project(self, points: Floats) -> Floats:
        """Pixels of points given in the camera frame.

        Parameters
        ----------
        points : (..., 3) float, camera frame (x right, y down, z forward), metres.

        Returns
        -------
        (..., 2) float, pixels; NaN where z <= 0 (behind the camera).
        """
        points = np.asarray(points, dtype=np.float64)
        z = points[..., 2:3]
        ahead = z > 0
        uv = points[..., :2] / np.where(ahead, z, 1.0)
        if self.model in _DISTORT and not self.is_pinhole:
            uv = _DISTORT[self.model](uv, self.distortion)
        pixels = uv * np.array([self.fx, self.fy]) + np.array([self.cx, self.cy])
        return np.where(ahead, pixels, np.nan)
