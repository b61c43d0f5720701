"""How far each instance stands out of the wall: tape, cards, stickers and dirt do not.

Detectors take flat marks on the wall for holds: a strip of coloured tape with a number on it has
a hold's colour and outline. The mesh knows better, where it is good enough to tell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.holds.geometry import rim_normal, triangles_of
from walltopo.meshes.similarity import fit_plane

__all__ = ["Rise", "flat_instances", "measure_rises"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RING = 1.8  # radius, in an instance's own radii, in which the wall around it is fitted
LARGEST = 0.5  # metres: radius beyond which nothing is a mark on the wall
LEAST_RING, MOST_RING = 24, 4_000  # triangles of wall that a plane is fitted to
AGREE_DEG = 25.0  # ring triangles turned farther away belong to another panel
ROUNDS = 4  # of fitting the plane without outliers (holds that were not found, edges)
OUTLIER = 3.0  # standard deviations
TOP = 90.0  # percentile of the heights that counts as the top


@dataclass(frozen=True)
class Rise:
    """How an instance stands out of the wall around it, in scan units.

    Parameters
    ----------
    height : 90th percentile of the heights of its vertices over the plane of the wall.
    noise : standard deviation of the centroids of the wall's triangles from that plane, robust.
    """

    height: float
    noise: float


@dataclass(frozen=True, eq=False)
class _Bare:
    """The triangles of no hold: the wall and its volumes."""

    tree: Any
    centroids: Floats
    normals: Floats
    label: NDArray[np.int32]

    @classmethod
    def of(cls, mesh: Mesh, face_instance: NDArray[np.int32], kinds: Mapping[int, str]) -> _Bare:
        from scipy.spatial import cKDTree

        bare = [0, *(number for number, kind in kinds.items() if kind == "volume")]
        rows = np.flatnonzero(np.isin(face_instance, bare))
        centroids = mesh.centroids[rows]
        return cls(cKDTree(centroids), centroids, mesh.normals[rows], face_instance[rows])

    def around(self, number: int, middle: Floats, normal: Floats, radius: float) -> Floats:
        """(n, 3) centroids of the wall around an instance that face as it does."""
        near = np.array(sorted(self.tree.query_ball_point(middle, radius)), dtype=np.int64)
        near = near[:: max(1, len(near) // MOST_RING)]
        agree = self.normals[near] @ normal > np.cos(np.radians(AGREE_DEG))
        return self.centroids[near[agree & (self.label[near] != number)]]


def _plane(points: Floats, normal: Floats) -> tuple[Floats, float]:
    """(4,) plane (unit normal, offset) through most of the points, and their spread around it."""
    plane, spread = np.zeros(4), np.inf
    kept = np.ones(len(points), dtype=np.bool_)
    for _ in range(ROUNDS):
        axis, offset = fit_plane(points[kept])
        plane = np.append(axis, -offset) * (1.0 if axis @ normal > 0 else -1.0)
        away = points @ plane[:3] + plane[3]
        spread = 1.4826 * float(np.median(np.abs(away[kept] - np.median(away[kept]))))
        kept = np.abs(away - np.median(away[kept])) <= OUTLIER * spread + 1e-12
    return plane, spread


def measure_rises(
    mesh: Mesh, face_instance: NDArray[np.int32], kinds: Mapping[int, str], unit: float
) -> dict[int, Rise]:
    """How far the instances stand out of the wall.

    Parameters
    ----------
    mesh : the scan's mesh; face_instance : (F,) int32, 0 = none.
    kinds : instance id to its class, "hold" or "volume".
    unit : scan units a metre.

    Returns
    -------
    By instance id. Left out are those with no triangles, larger than any mark on a wall, or with
    too little wall around them.
    """
    bare = _Bare.of(mesh, face_instance, kinds)
    if len(bare.centroids) == 0:
        return {}
    rises: dict[int, Rise] = {}
    for number, rows in triangles_of(face_instance, sorted(kinds)):
        normal = rim_normal(mesh, rows)
        if normal is None:
            continue
        points = mesh.vertices[np.unique(mesh.faces[rows])]
        middle = np.median(points, axis=0)
        reach = float(np.percentile(np.linalg.norm(points - middle, axis=1), 98))
        if reach > LARGEST * unit:
            continue
        ring = bare.around(number, middle, normal, RING * reach)
        if len(ring) >= LEAST_RING:
            plane, noise = _plane(ring, normal)
            heights = points @ plane[:3] + plane[3]
            rises[number] = Rise(float(np.percentile(heights, TOP)), noise)
    return rises


def flat_instances(rises: Mapping[int, Rise], unit: float, below: float) -> set[int]:
    """Ids of the instances that stand out by less than `below` metres.

    Where the wall around is rougher than half of that, the mesh cannot tell, and nothing is flat.
    """
    return {
        number
        for number, rise in rises.items()
        if rise.height < below * unit and rise.noise < 0.5 * below * unit
    }
