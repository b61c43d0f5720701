"""The triangles of a mesh by place: found fast, one index a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh

__all__ = ["Triangles", "triangles_of_mesh"]

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


class Triangles:
    """Triangles sorted along the longest side of the mesh.

    A tree of a million centroids takes a second to build; a ball lies in a slab of some thousand.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._centroids = mesh.centroids
        self._axis = int(np.ptp(mesh.vertices, axis=0).argmax()) if len(mesh.vertices) else 0
        self._order = np.argsort(self._centroids[:, self._axis], kind="stable")
        self._along = self._centroids[self._order, self._axis]

    def within(self, at: Sequence[float] | Floats, radius: float) -> Ints:
        """(n,) int64, ascending: triangles whose centroid is at most `radius` from a place."""
        middle = np.asarray(at, dtype=np.float64)
        here = float(middle[self._axis])
        first = np.searchsorted(self._along, here - radius, side="left")
        last = np.searchsorted(self._along, here + radius, side="right")
        slab = self._order[first:last]
        away = ((self._centroids[slab] - middle) ** 2).sum(axis=1)
        return np.sort(slab[away <= radius**2])


_KNOWN: WeakKeyDictionary[Mesh, Triangles] = WeakKeyDictionary()


def triangles_of_mesh(mesh: Mesh) -> Triangles:
    """The index of a mesh; made once, kept as long as the mesh."""
    if mesh not in _KNOWN:
        _KNOWN[mesh] = Triangles(mesh)
    return _KNOWN[mesh]
