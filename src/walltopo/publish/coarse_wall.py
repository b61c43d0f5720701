"""A wall of few triangles, on which the whole surface is judged in little time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.core.parallel import available_cores
from walltopo.publish.meshopt import available
from walltopo.publish.surface import same_places, simplify, split_at_borders

Labels = NDArray[np.int32]

MAX_TRIANGLES = 60_000


@dataclass(frozen=True, eq=False)
class CoarseWall:
    """The simplified mesh of a wall.

    Parameters
    ----------
    mesh : c triangles; none mixes two holds.
    labels : (c,) int32, hold id of each triangle, 0 = wall.
    nearest : (F,) the nearest of these triangles for each face of the wall's own mesh.
    """

    mesh: Mesh
    labels: Labels
    nearest: NDArray[np.int64]


def coarse_wall(mesh: Mesh, labels: Labels, triangles: int = MAX_TRIANGLES) -> CoarseWall:
    """Return the wall in at most about `triangles`; unchanged without meshoptimizer.

    Parameters
    ----------
    labels : (F,) int32, hold id of each face, 0 = wall.
    """
    from scipy.spatial import cKDTree

    if not available() or len(mesh.faces) <= triangles:
        return CoarseWall(mesh, labels, np.arange(len(mesh.faces)))
    surface = simplify(split_at_borders(mesh, labels), triangles)
    number = same_places(surface.positions)
    _, first = np.unique(number, return_index=True)
    faces = number[surface.triangles].astype(np.int32)
    coarse = Mesh(surface.positions[first].astype(np.float64), faces)
    _, nearest = cKDTree(coarse.centroids).query(mesh.centroids, workers=available_cores())
    return CoarseWall(coarse, surface.feature[surface.triangles[:, 0]], nearest)
