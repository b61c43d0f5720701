"""Project vertices to pixels: camera models for numba kernels, and clipping at the near plane."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.geometry.kernels import kernel

Floats = NDArray[np.float64]


def screen_vertices(local: Floats, camera: Camera) -> Floats:
    """Return the pixels and 1/z of vertices in the camera frame.

    Parameters
    ----------
    local : (V, 3) float, camera frame.

    Returns
    -------
    (V, 3) float64: x and y in pixels, 1/z. All are zero for a vertex behind the camera, or so far
    off its axis that the distortion model is not invertible.
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
    """Return the largest sqrt(x² + y²) / z up to which the distortion model is one-to-one.

    Polynomial distortion with a negative term folds back at some angle, and points beyond it would
    be drawn inside the photo. The limit is the minimum over 16 directions; it is infinite if the
    model does not fold within 20 focal lengths.
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


def lens_of(camera: Camera) -> NDArray[np.float64]:
    """Return the camera parameters for `distort`.

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
    """Return the pixel of the direction (u, v, 1) in the camera frame."""
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


# Near plane as a share of the farthest depth: independent of scale, below any real distance.
NEAR_SHARE = 1e-4


def clip_near(
    local: Floats, faces: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32] | None, Floats]:
    """Clip the triangles that cross the near plane.

    Parameters
    ----------
    local : (V, 3) float, vertices in the camera frame.
    faces : (F, 3) int32.

    Returns
    -------
    triangles : (T, 3) int32, indices into the returned vertices; without clipping, triangles
        behind the camera remain (their vertices have z <= 0).
    owner : (T,) int32, source face of each triangle; None if nothing was clipped.
    vertices : the input vertices and the new ones.
    """
    farthest = float(local[:, 2].max(initial=0.0))
    near = farthest * NEAR_SHARE
    behind = local[:, 2] < near
    if farthest <= 0 or not behind.any():
        return faces, None, local
    count = behind[faces].sum(axis=1)
    crossing = np.flatnonzero((count > 0) & (count < 3))
    if len(crossing) == 0:
        return faces, None, local
    corners, parts = [], []
    for face in crossing:
        polygon = _cut(local[faces[face]], near)
        for k in range(1, len(polygon) - 1):
            corners.append(polygon[[0, k, k + 1]])
            parts.append(face)
    added = np.concatenate(corners)
    new = (len(local) + np.arange(len(added), dtype=np.int32)).reshape(-1, 3)
    kept = np.flatnonzero(count == 0)
    owner = np.concatenate([kept, np.array(parts)]).astype(np.int32)
    # Keep the order of faces, because the lowest face index wins ties in depth.
    order = np.argsort(owner, kind="stable")
    triangles = np.concatenate([faces[kept], new.astype(np.int32)])[order]
    return np.ascontiguousarray(triangles), owner[order], np.concatenate([local, added])


def _cut(triangle: Floats, near: float) -> Floats:
    """Return the (3 or 4, 3) polygon of the part of a triangle with z >= near."""
    points = []
    for k in range(3):
        p, q = triangle[k], triangle[(k + 1) % 3]
        if p[2] >= near:
            points.append(p)
        if (p[2] >= near) != (q[2] >= near):
            cut = p + (near - p[2]) / (q[2] - p[2]) * (q - p)
            cut[2] = near
            points.append(cut)
    return np.array(points)
