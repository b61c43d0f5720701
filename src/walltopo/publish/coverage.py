"""Count the photos that see each part of the wall, and find where more would help."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.core.parallel import available_cores, map_ahead

Floats = NDArray[np.float64]

MIN_PHOTOS = 3  # a surface seen by fewer photos is unreliable
LONGEST = 320  # pixels of the depth picture for the occlusion test
SLACK = 0.015  # share of the depth by which a face may lie behind the depth picture


def count_views(mesh: Mesh, views: Sequence[View]) -> NDArray[np.int32]:
    """Return the (F,) int32 number of photos in which a face is visible from its front."""
    from walltopo.geometry.zbuffer import faces_in_view, render_culled

    centres, normals = mesh.centroids, mesh.normals

    def visible(view: View) -> NDArray[np.int64]:
        camera = view.camera.scaled(LONGEST / max(view.camera.width, view.camera.height))
        _, depth = render_culled(mesh, camera, view.cam_from_world)
        rows = faces_in_view(mesh, camera, view.cam_from_world)
        local = view.to_camera(centres[rows])
        pixel = camera.project(local)
        with np.errstate(invalid="ignore"):
            inside = (pixel >= 0).all(axis=1) & (pixel < [camera.width, camera.height]).all(axis=1)
        towards_camera = ((view.centre - centres[rows]) * normals[rows]).sum(axis=1) > 0
        index = np.flatnonzero(inside & towards_camera)
        column, row = pixel[index].astype(int).T
        return rows[index[local[index, 2] <= depth[row, column] * (1 + SLACK)]]

    counts = np.zeros(len(mesh.faces), dtype=np.int32)
    for rows in map_ahead(visible, views):
        counts[rows] += 1
    return counts


def nearest_counts(mesh: Mesh, counts: NDArray[np.int32], other: Mesh) -> NDArray[np.int32]:
    """Return for the (F,) faces of another mesh the counts of the nearest faces of this one."""
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(mesh.centroids).query(other.centroids, workers=available_cores())
    return counts[nearest]


@dataclass(frozen=True)
class Spot:
    """A part of the wall that too few photos see.

    Parameters
    ----------
    centre : (3,) world.
    area : square metres (square units when unscaled) that fewer than `MIN_PHOTOS` photos see.
    views : mean number of photos over that area.
    """

    centre: Floats
    area: float
    views: float


def low_coverage_spots(
    centres: Floats,
    areas: Floats,
    counts: NDArray[np.int32],
    right: Floats,
    cell: float,
    max_spots: int = 5,
) -> list[Spot]:
    """Return the worst cells of a grid over the wall's front, largest low-coverage area first.

    Parameters
    ----------
    centres, areas, counts : per triangle of the climbing surface.
    right : (3,) horizontal direction along the wall.
    cell : side of a cell, world units.
    """
    low = counts < MIN_PHOTOS
    if not low.any():
        return []
    grid = np.floor(np.stack([centres @ right, centres[:, 2]], axis=-1) / cell).astype(np.int64)
    _, group = np.unique(grid, axis=0, return_inverse=True)
    whole = np.bincount(group, areas)
    uncovered = np.bincount(group, areas * low)
    # Every border has a few such triangles, so a cell needs a fair share of them.
    enough = (uncovered > 0.25 * whole) & (uncovered > 0.1 * cell**2)
    worst = [k for k in np.argsort(-uncovered) if enough[k]]
    spots = []
    for k in worst[:max_spots]:
        chosen = low & (group == k)
        weight = areas[chosen] / areas[chosen].sum()
        centre = (centres[chosen] * weight[:, None]).sum(axis=0)
        spots.append(Spot(centre, float(uncovered[k]), float((counts[chosen] * weight).sum())))
    return spots
