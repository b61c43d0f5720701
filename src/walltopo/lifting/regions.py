"""Labels as regions of the mesh: faces across edges, and pinholes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["fill_pinholes", "neighbours_of"]

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]

# A hole this small, against the instance around it, is filled.
PINHOLE = 0.05


def neighbours_of(faces: Ints, vertices: int) -> Ints:
    """Faces across each edge.

    Parameters
    ----------
    faces : (C, 3) int32, some faces of a mesh; vertices : number of vertices of the mesh.

    Returns
    -------
    (C, 3) int32: the face that shares the edge from corner k to corner k + 1, -1 = none among
    these faces; of several (non-manifold edges) the first.
    """
    return _neighbours(np.ascontiguousarray(faces), vertices)


@njit(cache=True)
def _neighbours(faces: Any, vertices: Any) -> Any:
    count = len(faces)
    starts = np.zeros(vertices + 1, dtype=np.int32)
    for f in range(count):
        for k in range(3):
            starts[min(faces[f, k], faces[f, (k + 1) % 3]) + 1] += 1
    for v in range(vertices):
        starts[v + 1] += starts[v]
    # Edges grouped by their lower vertex: (upper vertex, face, corner).
    upper = np.zeros(3 * count, dtype=np.int32)
    edge = np.zeros(3 * count, dtype=np.int32)
    place = starts[:-1].copy()
    for f in range(count):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            at = place[min(a, b)]
            place[min(a, b)] += 1
            upper[at], edge[at] = max(a, b), 3 * f + k
    found = np.full((count, 3), -1, dtype=np.int32)
    for v in range(vertices):
        for i in range(starts[v], starts[v + 1]):
            for j in range(starts[v], starts[v + 1]):
                other = edge[j] // 3
                if i != j and upper[i] == upper[j] and other != edge[i] // 3:
                    found[edge[i] // 3, edge[i] % 3] = other
                    break
    return found


@njit(cache=True)
def _root(parent: Any, k: Any) -> Any:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@njit(cache=True)
def _components(neighbours: Any, label: Any) -> Any:
    """(C,) lowest face of each face's connected region of one label."""
    parent = np.arange(len(label)).astype(np.int32)
    for f in range(len(label)):
        for k in range(3):
            other = neighbours[f, k]
            if other >= 0 and label[other] == label[f]:
                a, b = _root(parent, f), _root(parent, other)
                parent[max(a, b)] = min(a, b)
    for f in range(len(label)):
        parent[f] = _root(parent, f)
    return parent


def fill_pinholes(neighbours: Ints, areas: Floats, winner: Ints) -> Ints:
    """Give small holes that one cluster encloses to it.

    Holes are regions of faces that some mask lies on but no cluster keeps; where the mesh, or
    what any mask ever touched, ends there, it is no hole.

    Returns
    -------
    (C,) int32, `winner` with the holes filled.
    """
    regions, inverse = np.unique(_components(neighbours, winner), return_inverse=True)
    size = np.bincount(inverse, areas, minlength=len(regions))
    around = np.where(neighbours >= 0, winner[neighbours], -2)
    own = winner[:, None]
    # Of every region: the lowest and highest label across its border; -2 where the mesh ends.
    across = around != own
    low = np.full(len(regions), np.iinfo(np.int32).max, dtype=np.int64)
    high = np.full(len(regions), -3, dtype=np.int64)
    region = np.broadcast_to(inverse[:, None], across.shape)
    np.minimum.at(low, region[across], around[across])
    np.maximum.at(high, region[across], around[across])
    total = np.bincount(np.maximum(winner, 0), np.where(winner >= 0, areas, 0.0))
    hole = (winner[regions] < 0) & (low == high) & (high >= 0)
    hole[hole] &= size[hole] <= PINHOLE * total[high[hole]]
    return np.where(hole[inverse], high[inverse], winner).astype(np.int32)
