"""Clipping of triangles that reach behind the camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["clip_near"]

Floats = NDArray[np.float64]

# The near plane as a share of the farthest vertex: scale-free, far below any real distance.
NEAR_SHARE = 1e-4


def clip_near(
    local: Floats, faces: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32] | None, Floats]:
    """Cut the triangles that cross the near plane.

    Parameters
    ----------
    local : (V, 3) float, vertices in the camera frame.
    faces : (F, 3) int32.

    Returns
    -------
    triangles : (T, 3) int32, indices into the returned vertices; triangles wholly behind the
        camera stay in (their vertices have z <= 0).
    owner : (T,) int32, the face each triangle comes from; None when nothing was cut.
    vertices : the vertices with those of the cuts appended.
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
    # Keep the order of faces, so that ties in depth go to the lowest face index.
    order = np.argsort(owner, kind="stable")
    triangles = np.concatenate([faces[kept], new.astype(np.int32)])[order]
    return np.ascontiguousarray(triangles), owner[order], np.concatenate([local, added])


def _cut(triangle: Floats, near: float) -> Floats:
    """The (3 or 4, 3) polygon of the part of a triangle with z >= near."""
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
