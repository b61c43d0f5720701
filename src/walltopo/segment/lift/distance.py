"""The mean camera-to-object distance: the unit of length in scans without a scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Mesh, View
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.segment.lift.settings import LiftParams, length_of_share

Floats = NDArray[np.float64]

MAX_RAYS = 96
CHUNKS = 64


def resolve_lengths(params: LiftParams, mesh: Mesh, views: Sequence[View]) -> LiftParams:
    """Return the parameters with lengths in the mesh's unit, resolving normalised lengths."""
    if not params.normalised:
        return params
    mean = mean_object_distance(mesh, views, params.seed)
    return replace(
        params,
        normalised=False,
        visibility_distance=length_of_share(params.visibility_share, mean),
    )


def mean_object_distance(mesh: Mesh, views: Sequence[View], seed: int) -> float:
    """Return the mean distance from cameras to the objects of their masks, in the mesh's unit.

    Cast the rays of `mask_rays`, and take the distance to the first triangle.

    Raises
    ------
    InputError : no ray hits the mesh.
    """
    origins, directions = mask_rays(views, seed)
    nearest = np.full((CHUNKS, len(origins)), np.inf)
    in_ranges(_first_hits, CHUNKS, mesh.vertices, mesh.faces, origins, directions, nearest)
    hits = nearest.min(axis=0)
    hits = hits[np.isfinite(hits)]
    if len(hits) == 0:
        raise InputError(
            "no ray through the centre of a mask hits the mesh",
            "Check that the cameras and the mesh are in the same coordinate frame.",
        )
    return float(hits.mean())


def mask_rays(views: Sequence[View], seed: int, number: int = MAX_RAYS) -> tuple[Floats, Floats]:
    """Return the rays through the centroids of up to `number` masks, drawn at random by `seed`.

    Returns
    -------
    origins, directions : (n, 3) float, world frame; directions have length 1.
    """
    pairs = [(v, m) for v, view in enumerate(views) for m, k in enumerate(view.masks) if k.area]
    chosen = np.random.default_rng(seed).permutation(len(pairs))[:number]
    origins, directions = np.zeros((len(chosen), 3)), np.zeros((len(chosen), 3))
    for row, pick in enumerate(chosen):
        view, mask = views[pairs[pick][0]], views[pairs[pick][0]].masks[pairs[pick][1]]
        rows, cols = np.nonzero(mask.bitmap)
        x = (mask.x + cols.mean() + 0.5) * view.camera.width / mask.width
        y = (mask.y + rows.mean() + 0.5) * view.camera.height / mask.height
        ray = np.append(_slope_of(view.camera, x, y), 1.0)
        origins[row] = view.centre
        directions[row] = view.cam_from_world[:, :3].T @ (ray / np.linalg.norm(ray))
    return origins, directions


def _slope_of(camera: Camera, x: float, y: float) -> Floats:
    """Return (2,) x/z and y/z of the ray through a pixel."""
    from walltopo.geometry.colmap import pycolmap

    if camera.is_pinhole:
        return np.array([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy])
    lens = pycolmap.Camera(
        model=camera.model, width=camera.width, height=camera.height, params=camera.params
    )
    slope = np.asarray(lens.cam_from_img(np.array([[x, y]])), dtype=np.float64)[0]
    return slope if np.isfinite(slope).all() else np.zeros(2)


@kernel
def _first_hits(
    begin: Any, end: Any, vertices: Any, faces: Any, origins: Any, directions: Any, nearest: Any
) -> None:
    """Find each ray's first hit per chunk of faces, by brute force.

    For so few rays, building a tree costs more than it saves.
    """
    chunks = len(nearest)
    for chunk in range(begin, end):
        for f in range(chunk * len(faces) // chunks, (chunk + 1) * len(faces) // chunks):
            a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
            e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            g0, g1, g2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            for r in range(len(origins)):
                d0, d1, d2 = directions[r, 0], directions[r, 1], directions[r, 2]
                p0, p1, p2 = d1 * g2 - d2 * g1, d2 * g0 - d0 * g2, d0 * g1 - d1 * g0
                det = e0 * p0 + e1 * p1 + e2 * p2
                if det == 0.0:
                    continue
                o0, o1, o2 = origins[r, 0] - a[0], origins[r, 1] - a[1], origins[r, 2] - a[2]
                u = (o0 * p0 + o1 * p1 + o2 * p2) / det
                if u < 0 or u > 1:
                    continue
                q0, q1, q2 = o1 * e2 - o2 * e1, o2 * e0 - o0 * e2, o0 * e1 - o1 * e0
                v = (d0 * q0 + d1 * q1 + d2 * q2) / det
                t = (g0 * q0 + g1 * q1 + g2 * q2) / det
                if v >= 0 and u + v <= 1 and 0 < t < nearest[chunk, r]:
                    nearest[chunk, r] = t


def distance_weight(distance: Floats, visibility_distance: float, power: float) -> Floats:
    """Return the weight of evidence at a distance, from 1 at the camera to 0 at the limit.

    Parameters
    ----------
    distance : (n,) float, from the camera centre, in the unit of `visibility_distance`.
    power : in [-1, 1]. The weight is (1 - x) ** (4 ** power), x = distance / limit. Power 0 is
        linear, -1 stays high until close to the limit, 1 falls early.

    Returns
    -------
    (n,) float in [0, 1]; 0 beyond the limit.
    """
    share = np.clip(1.0 - np.asarray(distance) / visibility_distance, 0.0, 1.0)
    return share ** (4.0**power)
