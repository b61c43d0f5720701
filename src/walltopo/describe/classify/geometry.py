"""Position, normal, size, area and wall angle of an instance, from its triangles alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.core.instances import triangles_of
from walltopo.geometry.similarity import plane_axes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RING = 1.8  # radius of the ring for the wall's normal, in radii of the hold
MIN_RING = 12  # minimum number of wall triangles in the ring
NEARNESS = 4.0  # exponent by which wall near the hold counts more than wall at the ring's end
CANDIDATES = 24  # triangles of the ring whose normal may be the panel's
AGREE_DEG = (40.0, 25.0, 15.0)  # angular tolerance of the normals, round by round


@dataclass(frozen=True, eq=False)
class Shape:
    """The geometry of one instance, world frame, metres.

    Parameters
    position : (3,) centroid of the surface, weighted by area.
    normal : (3,) unit normal of the wall under it, out of the wall.
    size : longest extent in the plane of the wall (robust: 1st to 99th percentile).
    protrusion_m : extent along the normal (robust, as `size`).
    standing_m : distance of `position` from the wall.
    area : total area of its triangles.
    steepness_deg : angle of the wall under it: 0 vertical, > 0 overhanging, < 0 slab.
    """

    position: Floats
    normal: Floats
    size: float
    protrusion_m: float
    standing_m: float
    area: float
    steepness_deg: float


def _spread(values: Floats) -> float:
    low, high = np.percentile(values, [1, 99])
    return float(high - low)


def _longest_extent(flat: Floats) -> float:
    """Return the longest extent of (n, 2) points over directions 7.5 degrees apart."""
    angles = np.arange(24) * np.pi / 24
    directions = np.stack([np.cos(angles), np.sin(angles)])
    return max(_spread(column) for column in (flat @ directions).T)


def rim_normal(mesh: Mesh, rows: Ints) -> Floats | None:
    """Return the normal of the wall under a hold, from the hold's own triangles.

    The summed area vectors of a patch depend on its rim only, not on its shape. They therefore
    point out of the wall under the hold. Return None if they cancel.
    """
    total = mesh.areas[rows] @ mesh.normals[rows]
    length = float(np.linalg.norm(total))
    return total / length if length > 1e-9 * float(mesh.areas[rows].sum() + 1e-300) else None


@dataclass(frozen=True, eq=False)
class _WallSurface:
    """The triangles of the wall without holds, thinned, with a search tree."""

    points: Floats
    normals: Floats
    areas: Floats
    tree: Any

    @classmethod
    def of(
        cls, mesh: Mesh, face_instance: NDArray[np.int32], max_triangles: int = 300_000
    ) -> _WallSurface | None:
        from scipy.spatial import cKDTree

        rows = np.flatnonzero(face_instance == 0)
        rows = rows[:: max(1, len(rows) // max_triangles)]
        if len(rows) == 0:
            return None
        points = mesh.centroids[rows]
        return cls(points, mesh.normals[rows], mesh.areas[rows], cKDTree(points))

    def around(self, position: Floats, first: Floats, radius: float) -> tuple[Floats, float | None]:
        """Return the normal of the panel around a point, and the point's distance from the panel.

        The normal is the mean of normals that agree. It starts from the normal with the most
        area near the point, with a bonus for agreement with the hold's rim (`first`). Three
        rounds then drop triangles of other panels and of missed holds. Return `first` and None
        if too few triangles remain.
        """
        rows = np.asarray(self.tree.query_ball_point(position, radius), dtype=np.int64)
        if len(rows) < MIN_RING:
            return first, None
        normals, areas = self.normals[rows], self.areas[rows]
        near = np.exp(-NEARNESS * ((self.points[rows] - position) ** 2).sum(axis=1) / radius**2)
        some = normals[np.linspace(0, len(rows) - 1, CANDIDATES).astype(int)]
        starts = np.vstack([first, some])
        agree = normals @ starts.T > np.cos(np.radians(AGREE_DEG[1]))
        votes = ((areas * near) @ agree) * (0.5 + np.maximum(0, starts @ first))
        normal, standing = starts[votes.argmax()], None
        for limit in AGREE_DEG:
            kept = normals @ normal > np.cos(np.radians(limit))
            if np.count_nonzero(kept) < MIN_RING:
                break
            normal = areas[kept] @ normals[kept]
            normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
            standing = float(np.median((position - self.points[rows[kept]]) @ normal))
        return normal, standing


def _shape(mesh: Mesh, rows: Ints, wall: _WallSurface | None) -> Shape:
    areas, centroids = mesh.areas[rows], mesh.centroids[rows]
    total = float(areas.sum())
    weights = areas / total if total > 0 else np.full(len(rows), 1 / len(rows))
    position = weights @ centroids
    normal = rim_normal(mesh, rows)
    normal = np.array([0.0, -1.0, 0.0]) if normal is None else normal
    standing: float | None = None
    corners = mesh.vertices[mesh.faces[rows].ravel()] - position
    if wall is not None:
        reach = float(np.linalg.norm(corners, axis=1).max())
        normal, standing = wall.around(position, normal, RING * reach)
    if standing is None:
        standing = -float(np.percentile(corners @ normal, 2))
    return Shape(
        position=position,
        normal=normal,
        size=_longest_extent(corners @ plane_axes(normal).T),
        protrusion_m=_spread(corners @ normal),
        standing_m=standing,
        area=total,
        steepness_deg=float(np.degrees(np.arcsin(np.clip(-normal[2], -1, 1)))),
    )


def measure_shapes(
    mesh: Mesh, face_instance: NDArray[np.int32], ids: list[int]
) -> dict[int, Shape]:
    """Return the shape of each instance that has triangles.

    Parameters
    ----------
    mesh : the scan's mesh; face_instance : (F,) int32, 0 = wall; ids : ids of the instances.
    """
    wall = _WallSurface.of(mesh, face_instance)
    return {number: _shape(mesh, rows, wall) for number, rows in triangles_of(face_instance, ids)}
