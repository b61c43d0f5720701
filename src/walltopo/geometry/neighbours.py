"""Which face lies across which edge, and what hangs together that way.

Importing this module imports numba: the lift asks for the neighbours of a million faces in a tenth
of a second.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import kernel

Ints = NDArray[np.int32]


def face_neighbours(faces: NDArray[np.integer]) -> Ints:
    """Faces across each edge.

    Parameters
    ----------
    faces : (F, 3), some or all faces of a mesh.

    Returns
    -------
    (F, 3) int32: the face that shares the edge from corner k to corner k + 1, -1 = none among
    these faces; of several (non-manifold edges) the first.
    """
    return _neighbours(np.ascontiguousarray(faces, np.int32), int(faces.max(initial=-1)) + 1)


def patches(neighbours: Ints, label: NDArray[np.integer]) -> tuple[Ints, Ints]:
    """Connected regions of one label.

    Parameters
    ----------
    neighbours : (F, 3), as of `face_neighbours`; label : (F,).

    Returns
    -------
    (F,) int32, number of each face's region, in the order of their first faces; and those.
    """
    parent = np.arange(len(label), dtype=np.int32)
    return _patches(neighbours, np.ascontiguousarray(label, np.int32), parent)


def parts(faces: NDArray[np.integer]) -> Ints:
    """(F,) number of the part of each face; faces that share an edge are of one part."""
    return patches(face_neighbours(faces), np.zeros(len(faces), dtype=np.int32))[0]


@kernel
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


@kernel
def root_of(parent: Any, k: Any) -> Any:
    """The lowest member that stands for k's part; ways to it become shorter."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@kernel
def _patches(neighbours: Any, label: Any, parent: Any) -> Any:
    for f in range(len(label)):
        for k in range(3):
            other = neighbours[f, k]
            if other >= 0 and label[other] == label[f]:
                a, b = root_of(parent, f), root_of(parent, other)
                parent[max(a, b)] = min(a, b)
    number = np.zeros(len(label), dtype=np.int32)
    first = np.zeros(len(label), dtype=np.int32)
    count = 0
    for f in range(len(label)):
        root = root_of(parent, f)
        if root == f:
            first[count] = f
            number[f] = count
            count += 1
        else:
            number[f] = number[root]
    return number, first[:count].copy()
