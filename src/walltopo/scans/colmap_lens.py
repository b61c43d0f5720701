"""Express any lens of COLMAP by the camera models that `walltopo.core.Camera` has.

Source of the models: COLMAP's `sensor/models.h` (SIMPLE_RADIAL_FISHEYE is OPENCV_FISHEYE with one
coefficient). Lenses without an equal model are fitted, and refused if the fit is not exact enough.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError
from walltopo.core.view import CAMERA_MODELS

if TYPE_CHECKING:
    from walltopo.geometry.colmap import pycolmap

Floats = NDArray[np.float64]

_MAX_ERROR_PX = 0.2  # per 1,000 px of the longer side: below the error of a feature
_GRID = 24  # pixels a side at which a fitted lens is compared
_FITTED = ("FULL_OPENCV", "OPENCV_FISHEYE")
_MAX_RADIUS = 20.0  # tangent of 87 degrees; Brown's model has no rays beyond


def camera_of(camera: pycolmap.Camera) -> Camera:
    """Return a COLMAP camera as a `Camera`, equal or within `_MAX_ERROR_PX` everywhere.

    Raises
    ------
    InputError : invalid parameters, or a lens that no known model expresses.
    """
    name, size = str(camera.model.name), (int(camera.width), int(camera.height))
    if name in CAMERA_MODELS:
        return Camera(name, *size, tuple(float(p) for p in camera.params))
    if len(camera.focal_length_idxs()) and len(camera.principal_point_idxs()) == 2:
        with np.errstate(all="ignore"):
            fits = [fit for model in _FITTED if (fit := _fit_lens(camera, model)) is not None]
        if fits:
            error, best = min(fits, key=lambda fit: fit[0])
            if error <= _MAX_ERROR_PX * max(size) / 1000:
                return best
    raise InputError(
        f"camera model {name!r} is not supported, and none of {', '.join(CAMERA_MODELS)} "
        "expresses this lens",
        "Undistort the photos first (COLMAP's image_undistorter).",
    )


def _fit_lens(camera: pycolmap.Camera, model: str) -> tuple[float, Camera] | None:
    """Return the largest error (pixels) and the camera of a model that fits a lens best."""
    width, height = int(camera.width), int(camera.height)
    columns, rows = np.meshgrid(np.linspace(0, width, _GRID), np.linspace(0, height, _GRID))
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    rays = np.asarray(camera.cam_from_img(pixels), dtype=np.float64)
    if not np.isfinite(rays).all() or np.linalg.norm(rays, axis=1).max() > _MAX_RADIUS:
        return None
    fx, fy = float(camera.focal_length_x), float(camera.focal_length_y)
    cx, cy = float(camera.principal_point_x), float(camera.principal_point_y)
    if min(fx, fy) <= 0:
        return None
    wanted = (pixels - [cx, cy]) / [fx, fy]
    terms = _lens_terms(rays, model)  # the first one is the scale of both focal lengths
    found, *_ = np.linalg.lstsq(np.concatenate(terms), wanted.T.ravel(), rcond=None)
    if not found[0] > 0:
        return None
    scale, lens = float(found[0]), tuple((found[1:] / found[0]).tolist())
    more = (0.0,) * (CAMERA_MODELS[model] - 4 - len(lens))
    fitted = Camera(model, width, height, (fx * scale, fy * scale, cx, cy, *lens, *more))
    there = fitted.project(np.column_stack([rays, np.ones(len(rays))]))
    return float(np.linalg.norm(there - pixels, axis=1).max()), fitted


def _lens_terms(rays: Floats, model: str) -> tuple[Floats, Floats]:
    """Return the terms (n, k) of a model's x and y, of which the lens parameters are the factors.

    The first column is the factor of the focal length; the others are in the model's order.
    """
    u, v = rays.T
    r2 = u * u + v * v
    if model == "OPENCV_FISHEYE":
        radius = np.maximum(np.sqrt(r2), 1e-12)
        theta = np.arctan(radius)
        powers = np.column_stack([theta ** (2 * k + 1) / radius for k in range(5)])
        return powers * u[:, None], powers * v[:, None]
    x = np.column_stack([u, u * r2, u * r2**2, 2 * u * v, r2 + 2 * u * u, u * r2**3])
    y = np.column_stack([v, v * r2, v * r2**2, r2 + 2 * v * v, 2 * u * v, v * r2**3])
    return x, y
