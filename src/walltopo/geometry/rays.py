"""Intersect rays with triangles; find the triangles near a point, in a cone or in a box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh

Floats = NDArray[np.float64]


class Bvh:
    """A bounding volume hierarchy over the triangles of a mesh.

    Parameters
    ----------
    vertices : (V, 3) float, world frame.
    faces : (F, 3) int.

    Notes
    -----
    Embree works in float32. So the mesh is moved and scaled into a unit box first, to keep the
    precision of a model far from its origin. The distance is recomputed in float64 from the plane
    of the triangle hit.
    """

    def __init__(self, vertices: Floats, faces: NDArray[np.int32]) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self._faces = np.ascontiguousarray(faces, dtype=np.int32)
        if len(self._faces) == 0:
            self._offset, self._factor, self._scene = np.zeros(3), 1.0, None
            return
        used = np.zeros(len(self._vertices), dtype=np.bool_)
        used[self._faces] = True
        low, high = self._vertices[used].min(axis=0), self._vertices[used].max(axis=0)
        self._offset = (low + high) / 2
        extent = float((high - low).max())
        self._factor = 1.0 / extent if extent > 0 else 1.0
        self._scene = EmbreeScene()
        small = ((self._vertices - self._offset) * self._factor).astype(np.float32)
        self._mesh = TriangleMesh(self._scene, small[self._faces])

    def first_hit(
        self, origins: Floats, directions: Floats
    ) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Return the first triangle that each ray hits, from either side.

        Parameters
        ----------
        origins : (n, 3) float, world frame.
        directions : (n, 3) float, of any length > 0.

        Returns
        -------
        face : (n,) int32, -1 without a hit.
        t : (n,) float64, the hit is at `origins + t * directions`; inf without a hit.
        """
        origins = np.ascontiguousarray(origins, dtype=np.float64)
        directions = np.ascontiguousarray(directions, dtype=np.float64)
        if origins.shape != directions.shape or origins.ndim != 2 or origins.shape[1] != 3:
            raise InputError(
                f"rays: origins and directions must both be (n, 3), got {origins.shape} "
                f"and {directions.shape}"
            )
        t = np.full(len(origins), np.inf)
        if self._scene is None or len(origins) == 0:
            return np.full(len(origins), -1, dtype=np.int32), t
        lengths = np.linalg.norm(directions, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise InputError("rays: a direction has length zero")
        start = ((origins - self._offset) * self._factor).astype(np.float32)
        face = np.array(
            self._scene.run(start, (directions / lengths).astype(np.float32)), dtype=np.int32
        )
        hit = np.flatnonzero(face >= 0)
        t[hit] = self._plane_distance(face[hit], origins[hit], directions[hit])
        return face, t

    def _plane_distance(
        self, face: NDArray[np.int32], origins: Floats, directions: Floats
    ) -> Floats:
        """Return the ray parameters at which rays meet their triangles' planes."""
        a, b, c = (self._vertices[self._faces[face, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        approach = np.einsum("ij,ij->i", directions, normals)
        gap = np.einsum("ij,ij->i", a - origins, normals)
        # The plane distance of a grazing ray is unstable; project the first corner onto the ray.
        grazing = np.abs(approach) < 1e-12 * np.linalg.norm(normals, axis=1)
        along = np.einsum("ij,ij->i", a - origins, directions) / (directions**2).sum(axis=1)
        return np.where(grazing, along, gap / np.where(grazing, 1.0, approach))


Ints = NDArray[np.int64]

CELL = 100  # triangles of a cell on a square wall
MIN_CELLS, MAX_CELLS = 60, 500  # along the mesh's longest side


class TriangleIndex:
    """An index of triangles, sorted along the mesh's longest side and by cubes.

    A k-d tree of a million centroids takes a second to build; sorting is faster, and a query ball
    lies in a slab of some thousand triangles.
    """

    def __init__(self, mesh: Mesh) -> None:
        # Keep no reference to the mesh, so that it is freed with its owner.
        self._vertices, self._faces, self._centroids = mesh.vertices, mesh.faces, mesh.centroids
        self._axis = int(np.ptp(mesh.vertices, axis=0).argmax()) if len(mesh.vertices) else 0

    @cached_property
    def _order(self) -> Ints:
        return np.argsort(self._centroids[:, self._axis], kind="stable")

    @cached_property
    def _along(self) -> Floats:
        return self._centroids[self._order, self._axis]

    def within(self, at: Sequence[float] | Floats, radius: float) -> Ints:
        """Return (n,) int64, ascending: triangles with a centroid at most `radius` from a point."""
        middle = np.asarray(at, dtype=np.float64)
        here = float(middle[self._axis])
        first = np.searchsorted(self._along, here - radius, side="left")
        last = np.searchsorted(self._along, here + radius, side="right")
        slab = self._order[first:last]
        away = ((self._centroids[slab] - middle) ** 2).sum(axis=1)
        return np.sort(slab[away <= radius**2])

    def in_cone(self, eye: Floats, axis: Floats, half_angle: float) -> Ints:
        """Return (n,) int64, ascending: a superset of the triangles that a cone of rays may hit.

        Parameters
        ----------
        eye : (3,) apex of the cone.
        axis : (3,) unit.
        half_angle : radians.
        """
        cells = self._cells
        if cells is None:
            return np.zeros(0, dtype=np.int64)
        offset = cells.middle - eye
        away = np.linalg.norm(offset, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            off_axis = np.arccos(np.clip(offset @ axis / away, -1, 1))
            angular_radius = np.arcsin(np.clip(cells.radius / away, 0, 1))
        return cells.triangles_of(
            (away <= cells.radius) | (off_axis <= half_angle + angular_radius)
        )

    def in_box(self, low: Floats, high: Floats) -> Ints:
        """Return (n,) int64, ascending: a superset of the triangles with a point in a box.

        Parameters
        ----------
        low, high : (3,) corners of the axis-aligned box.
        """
        cells = self._cells
        if cells is None:
            return np.zeros(0, dtype=np.int64)
        away = cells.middle - np.clip(cells.middle, low, high)
        return cells.triangles_of(np.linalg.norm(away, axis=1) <= cells.radius)

    @cached_property
    def _cells(self) -> _Cells | None:
        if len(self._centroids) == 0:
            return None
        return _Cells.of(self._vertices, self._faces, self._centroids)


def cube_numbers(points: Floats, low: Floats, size: float, along: int) -> NDArray[np.int32]:
    """Return the (n,) number of the cube that each point lies in.

    Parameters
    ----------
    points : (n, 3).
    low : (3,) corner of the first cube; no coordinate of a point is less.
    size : side of a cube.
    along : maximum number of sides between `low` and a point along an axis, at most 1,000.
    """
    # Compute by axis, because tables of three numbers per triangle fill the memory.
    number = np.zeros(len(points), dtype=np.int32)
    for axis, least in zip(points.T, low, strict=True):
        number *= along + 1
        number += ((axis - least) / size).astype(np.int32)
    return number


@dataclass(frozen=True, eq=False)
class _Cells:
    """A mesh divided into cubes, each with the bounding ball of its triangles.

    Parameters
    ----------
    rows : (F,) int32, triangles, grouped by cell.
    begin : (C + 1,) start of each cell in `rows`.
    middle : (C, 3) centre of the cell's ball.
    radius : (C,) of the cell's ball.
    """

    rows: NDArray[np.int32]
    begin: Ints
    middle: Floats
    radius: Floats

    @classmethod
    def of(cls, vertices: Floats, faces: NDArray[np.int32], centroids: Floats) -> _Cells:
        """Divide a mesh into cubes by the triangles' centroids."""
        low = centroids.min(axis=0)
        along = int(np.clip(np.sqrt(len(faces) / CELL), MIN_CELLS, MAX_CELLS))
        size = max(float((centroids.max(axis=0) - low).max()) / along, 1e-9)
        number = cube_numbers(centroids, low, size, along)
        rows = np.argsort(number, kind="stable").astype(np.int32)
        first = np.flatnonzero(np.diff(number[rows], prepend=-1))
        del number
        count = np.diff(first, append=len(rows))
        middle = np.stack([np.add.reduceat(axis[rows], first) / count for axis in centroids.T], 1)
        radius = np.zeros(len(first))
        for corner in faces.T:
            square = np.zeros(len(rows))
            for axis, own in zip(vertices.T, middle.T, strict=True):
                square += (axis[corner[rows]] - np.repeat(own, count)) ** 2
            radius = np.maximum(radius, np.sqrt(np.maximum.reduceat(square, first)))
        return cls(rows, np.append(first, len(rows)), middle, radius)

    def triangles_of(self, chosen: NDArray[np.bool_]) -> Ints:
        """Return the triangles of the (C,) chosen cells, ascending."""
        begin, count = self.begin[:-1][chosen], np.diff(self.begin)[chosen]
        shift = np.repeat(begin - np.cumsum(count) + count, count)
        return np.sort(self.rows[shift + np.arange(len(shift))]).astype(np.int64)


_INDEX_OF_MESH: WeakKeyDictionary[Mesh, TriangleIndex] = WeakKeyDictionary()


def triangle_index_of(mesh: Mesh) -> TriangleIndex:
    """Return the triangle index of a mesh, cached for the lifetime of the mesh."""
    if mesh not in _INDEX_OF_MESH:
        _INDEX_OF_MESH[mesh] = TriangleIndex(mesh)
    return _INDEX_OF_MESH[mesh]
