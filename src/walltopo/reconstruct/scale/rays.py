"""Pixels to viewing rays, and points from the pixels of several photos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, View

Floats = NDArray[np.float64]

_LEAST_ANGLE_DEG = 1.5
_MOST_PAIRS = 300


def undistort(camera: Camera, pixels: Floats) -> Floats:
    """Normalised image coordinates (x/z, y/z) (n, 2) of pixels (n, 2).

    Inverts `Camera.project` by fixed-point steps, which converge for the distortion of phones.
    """
    focal = np.array([camera.fx, camera.fy])
    uv = (pixels - [camera.cx, camera.cy]) / focal
    for _ in range(0 if camera.is_pinhole else 30):
        step = (camera.project(np.concatenate([uv, np.ones_like(uv[:, :1])], 1)) - pixels) / focal
        uv = uv - step
        if np.abs(step).max() < 1e-12:
            break
    return uv


@dataclass(frozen=True, eq=False)
class Triangulated:
    """A point seen in several photos.

    Parameters
    ----------
    point : (3,) float, frame of the views.
    inliers : (n,) bool, which of the observations agree with it.
    residual_px : root mean square reprojection error of those.
    """

    point: Floats
    inliers: NDArray[np.bool_]
    residual_px: float


def triangulate(
    views: Sequence[View], pixels: Floats, tolerance_px: float = 3.0
) -> Triangulated | None:
    """The point that most of the observations agree on, by least reprojection error.

    Parameters
    ----------
    views : n posed photos.
    pixels : (n, 2) float, where each sees the point.
    tolerance_px : reprojection error up to which an observation agrees.

    Returns
    -------
    None where no two photos agree, or where all that do look from nearly the same direction.
    """
    if len(views) < 2:
        return None
    origins = np.array([view.centre for view in views])
    directions = np.array([_ray(view, xy) for view, xy in zip(views, pixels, strict=True)])
    best: tuple[int, float, NDArray[np.bool_], Floats] | None = None
    pairs = list(combinations(range(len(views)), 2))
    for a, b in pairs[:: 1 + len(pairs) // _MOST_PAIRS]:
        if abs(directions[a] @ directions[b]) > np.cos(np.radians(_LEAST_ANGLE_DEG)):
            continue
        point = _nearest_to_rays(origins[[a, b]], directions[[a, b]])
        errors = _errors(views, pixels, point)
        inliers = errors <= tolerance_px
        score = (int(inliers.sum()), -float(np.minimum(errors, tolerance_px).sum()))
        if inliers.sum() >= 2 and (best is None or score > best[:2]):
            best = (*score, inliers, point)
    if best is None:
        return None
    inliers, point = best[2], best[3]
    for _ in range(2):
        chosen = [view for view, good in zip(views, inliers, strict=True) if good]
        point = _polish(chosen, pixels[inliers], point)
        again = _errors(views, pixels, point) <= tolerance_px
        if again.sum() < 2:
            break
        inliers = again
    errors = _errors(views, pixels, point)[inliers]
    return Triangulated(point, inliers, float(np.sqrt(np.mean(errors**2))))


def _ray(view: View, pixel: Floats) -> Floats:
    uv = undistort(view.camera, pixel[None])[0]
    ray = view.cam_from_world[:, :3].T @ np.array([*uv, 1.0])
    return ray / np.linalg.norm(ray)


def _nearest_to_rays(origins: Floats, directions: Floats) -> Floats:
    projectors = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    right = (projectors @ origins[:, :, None]).sum(axis=0)[:, 0]
    return np.linalg.solve(projectors.sum(axis=0), right)


def _errors(views: Sequence[View], pixels: Floats, point: Floats) -> Floats:
    seen = np.array([view.project(point) for view in views])
    return np.nan_to_num(np.linalg.norm(seen - pixels, axis=1), nan=np.inf)


def _polish(views: Sequence[View], pixels: Floats, point: Floats) -> Floats:
    """Gauss-Newton on the reprojection error, with numeric derivatives."""
    for _ in range(5):
        depth = min(float(view.to_camera(point)[2]) for view in views)
        if depth <= 0:
            return point
        delta = 1e-5 * depth
        base = np.concatenate([view.project(point) for view in views])
        columns = [
            (np.concatenate([view.project(point + delta * axis) for view in views]) - base) / delta
            for axis in np.eye(3)
        ]
        step = np.linalg.lstsq(np.stack(columns, 1), pixels.ravel() - base, rcond=None)[0]
        point = point + step
        if np.linalg.norm(step) < 1e-9 * depth:
            break
    return point
