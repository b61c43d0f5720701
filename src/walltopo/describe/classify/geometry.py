"""Position, normal, size, area and wall angle of an instance, from its triangles alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RING = 1.8  # radius around a hold, in its own radii, in which the wall's normal is taken
MIN_RING = 12  # triangles of wall needed for that
NEARNESS = 4.0  # how much more the wall beside the hold counts than that at the ring's end
CANDIDATES = 24  # triangles of the ring whose normal may be the panel's
AGREE_DEG = (40.0, 25.0, 15.0)  # how well they must agree, round by round


@dataclass(frozen=True, eq=False)
class Shape:
    """Geometry of one instance, world frame, metres.

    Parameters
    ----------
    position : (3,) centroid of its surface, weighted by area.
    normal : (3,) unit, of the wall it sits on, out of the wall.
    size : longest extent in the plane of the wall (robust: 1st to 99th percentile).
    protrusion_m : how far it stands out of the wall it sits on (99th percentile).
    standing_m : how far `position` stands out of that wall.
    area : of its triangles.
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


def plane_axes(normal: Floats) -> Floats:
    """(2, 3) unit vectors across a normal: to the right and up, seen from in front."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(normal, right)])


def _longest(flat: Floats) -> float:
    """Longest extent of (n, 2) points over directions 7.5 degrees apart."""
    angles = np.arange(24) * np.pi / 24
    directions = np.stack([np.cos(angles), np.sin(angles)])
    return max(_spread(column) for column in (flat @ directions).T)


def rim_normal(mesh: Mesh, rows: Ints) -> Floats | None:
    """The normal of the wall under a hold, from the hold's own triangles.

    The summed area vectors of a patch depend on its rim only, not on its shape, so they point
    out of the wall that the hold sits on whatever the hold looks like. None where they cancel.
    """
    total = mesh.areas[rows] @ mesh.normals[rows]
    length = float(np.linalg.norm(total))
    return total / length if length > 1e-9 * float(mesh.areas[rows].sum() + 1e-300) else None


@dataclass(frozen=True, eq=False)
class _Wall:
    """The triangles of the wall without holds, thinned, for looking up its normal."""

    points: Floats
    normals: Floats
    areas: Floats
    tree: Any

    @classmethod
    def of(cls, mesh: Mesh, face_instance: NDArray[np.int32], most: int = 300_000) -> _Wall | None:
        from scipy.spatial import cKDTree

        rows = np.flatnonzero(face_instance == 0)
        rows = rows[:: max(1, len(rows) // most)]
        if len(rows) == 0:
            return None
        points = mesh.centroids[rows]
        return cls(points, mesh.normals[rows], mesh.areas[rows], cKDTree(points))

    def around(self, position: Floats, first: Floats, radius: float) -> tuple[Floats, float | None]:
        """Normal of the panel around a point, and how far the point stands out of the panel.

        The mean of the normals that agree with each other: starts from the normal that most of
        the wall near the point has, the hold's rim (`first`) having a say, and drops, in three
        rounds, triangles of other panels and of holds that were not found. `first` and None where
        too few are left.
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


def _shape(mesh: Mesh, rows: Ints, wall: _Wall | None) -> Shape:
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
        size=_longest(corners @ plane_axes(normal).T),
        protrusion_m=_spread(corners @ normal),
        standing_m=standing,
        area=total,
        steepness_deg=float(np.degrees(np.arcsin(np.clip(-normal[2], -1, 1)))),
    )


def triangles_of(
    face_instance: NDArray[np.int32], ids: Iterable[int]
) -> Iterator[tuple[int, Ints]]:
    """The triangles of each instance that has any: id and (n,) indices, in the order of `ids`."""
    order = np.argsort(face_instance, kind="stable")
    labels = face_instance[order]
    for number in ids:
        first, last = np.searchsorted(labels, [number, number + 1])
        if last > first:
            yield number, order[first:last]


def measure_shapes(
    mesh: Mesh, face_instance: NDArray[np.int32], ids: list[int]
) -> dict[int, Shape]:
    """The shape of each instance that has triangles; ids without are left out.

    Parameters
    ----------
    mesh : the scan's mesh; face_instance : (F,) int32, 0 = wall; ids : instances wanted.
    """
    wall = _Wall.of(mesh, face_instance)
    return {number: _shape(mesh, rows, wall) for number, rows in triangles_of(face_instance, ids)}
