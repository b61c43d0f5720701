"""The triangles of a mesh by place: found fast, one index a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

CELLS = 60  # along the longest side of the mesh: some thousand, of some hundred triangles each


class Triangles:
    """Triangles sorted along the longest side of the mesh, and by cubes.

    A tree of a million centroids takes a second to build; a ball lies in a slab of some thousand.
    """

    def __init__(self, mesh: Mesh) -> None:
        # Of the mesh itself nothing is kept: it ends when whoever made it lets go of it.
        self._vertices, self._faces, self._centroids = mesh.vertices, mesh.faces, mesh.centroids
        self._axis = int(np.ptp(mesh.vertices, axis=0).argmax()) if len(mesh.vertices) else 0

    @cached_property
    def _order(self) -> Ints:
        return np.argsort(self._centroids[:, self._axis], kind="stable")

    @cached_property
    def _along(self) -> Floats:
        return self._centroids[self._order, self._axis]

    def within(self, at: Sequence[float] | Floats, radius: float) -> Ints:
        """(n,) int64, ascending: triangles whose centroid is at most `radius` from a place."""
        middle = np.asarray(at, dtype=np.float64)
        here = float(middle[self._axis])
        first = np.searchsorted(self._along, here - radius, side="left")
        last = np.searchsorted(self._along, here + radius, side="right")
        slab = self._order[first:last]
        away = ((self._centroids[slab] - middle) ** 2).sum(axis=1)
        return np.sort(slab[away <= radius**2])

    def towards(self, eye: Floats, axis: Floats, half_angle: float) -> Ints:
        """(n,) int64, ascending: all triangles that a cone of rays may meet, and some besides.

        Parameters
        ----------
        eye : (3,) the cone's tip; axis : (3,) unit; half_angle : radians.
        """
        cells = self._cells
        if cells is None:
            return np.zeros(0, dtype=np.int64)
        offset = cells.middle - eye
        away = np.linalg.norm(offset, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            beside = np.arccos(np.clip(offset @ axis / away, -1, 1))
            wide = np.arcsin(np.clip(cells.radius / away, 0, 1))
        met = np.flatnonzero((away <= cells.radius) | (beside <= half_angle + wide))
        found = np.zeros(len(cells.rows), dtype=np.bool_)
        for k in met.tolist():
            found[cells.of_cell(k)] = True
        return np.flatnonzero(found)

    @cached_property
    def _cells(self) -> _Cells | None:
        if len(self._centroids) == 0:
            return None
        return _Cells.of(self._vertices, self._faces, self._centroids)


@dataclass(frozen=True, eq=False)
class _Cells:
    """A mesh cut into cubes, each with the ball that its triangles lie in.

    Parameters
    ----------
    rows : (F,) triangles, cell by cell; begin : (C + 1,) where each cell's begin.
    middle : (C, 3); radius : (C,).
    """

    rows: Ints
    begin: Ints
    middle: Floats
    radius: Floats

    @classmethod
    def of(cls, vertices: Floats, faces: NDArray[np.int32], centroids: Floats) -> _Cells:
        size = max(float(np.ptp(centroids, axis=0).max()) / CELLS, 1e-9)
        cube = ((centroids - centroids.min(axis=0)) / size).astype(np.int64)
        number = (cube[:, 0] * (CELLS + 1) + cube[:, 1]) * (CELLS + 1) + cube[:, 2]
        rows = np.argsort(number, kind="stable")
        first = np.flatnonzero(np.diff(number[rows], prepend=-1))
        count = np.diff(first, append=len(rows))
        places = centroids[rows]
        middle = np.add.reduceat(places, first) / count[:, None]
        own = np.repeat(middle, count, axis=0)
        radius = np.zeros(len(first))
        for corner in faces[rows].T:
            reach = np.linalg.norm(vertices[corner] - own, axis=1)
            radius = np.maximum(radius, np.maximum.reduceat(reach, first))
        return cls(rows, np.append(first, len(rows)), middle, radius)

    def of_cell(self, number: int) -> Ints:
        """The triangles of one cell."""
        return self.rows[self.begin[number] : self.begin[number + 1]]


_KNOWN: WeakKeyDictionary[Mesh, Triangles] = WeakKeyDictionary()


def triangles_of_mesh(mesh: Mesh) -> Triangles:
    """The index of a mesh; made once, kept as long as the mesh."""
    if mesh not in _KNOWN:
        _KNOWN[mesh] = Triangles(mesh)
    return _KNOWN[mesh]
