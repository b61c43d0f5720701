"""Edges, faces and parts of a mesh by counting, where a sort of millions of keys is slow.

Importing this module imports numba.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import kernel
from walltopo.geometry.neighbours import root_of

Ints = NDArray[np.int64]


def grouped_edges(faces: NDArray[np.integer]) -> tuple[Ints, Ints, Ints]:
    """The undirected edges of (F, 3) faces.

    Returns
    -------
    (E, 2) vertices of each, smaller first, ascending; (E,) faces at each; (F, 3) index of the edge
    from corner k to corner k + 1.
    """
    return _edges(np.ascontiguousarray(faces, np.int32), int(faces.max(initial=-1)) + 1)


def repeated(faces: NDArray[np.integer]) -> NDArray[np.bool_]:
    """(F,) whether an earlier face has the same three vertices."""
    corners = np.sort(faces, axis=1).astype(np.int32)
    return _repeated(corners, int(faces.max(initial=-1)) + 1)


def linked(count: int, first: Ints, second: Ints) -> NDArray[np.int32]:
    """(count,) number of the connected part of each vertex, in the order of their first.

    Parameters
    ----------
    first, second : (E,) edges; the same pair may come more than once.
    """
    return _linked(count, np.ascontiguousarray(first), np.ascontiguousarray(second))


@kernel
def _sorted_by(keys: Any, order: Any, most: Any) -> Any:
    """The order, stably sorted by keys below `most`: a counting sort."""
    place = np.zeros(most + 1, dtype=np.int64)
    for key in keys:
        place[key + 1] += 1
    for key in range(most):
        place[key + 1] += place[key]
    found = np.zeros_like(order)
    for item in order:
        found[place[keys[item]]] = item
        place[keys[item]] += 1
    return found


@kernel
def _edges(faces: Any, vertices: Any) -> Any:
    count = 3 * len(faces)
    low, high = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    for f in range(len(faces)):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            low[3 * f + k], high[3 * f + k] = min(a, b), max(a, b)
    slots = _sorted_by(low, _sorted_by(high, np.arange(count), vertices), vertices)
    pairs = np.zeros((count, 2), dtype=np.int64)
    met = np.zeros(count, dtype=np.int64)
    of_face = np.zeros((len(faces), 3), dtype=np.int64)
    edge = -1
    for at in range(count):
        slot = slots[at]
        if edge < 0 or pairs[edge, 0] != low[slot] or pairs[edge, 1] != high[slot]:
            edge += 1
            pairs[edge, 0], pairs[edge, 1] = low[slot], high[slot]
        met[edge] += 1
        of_face[slot // 3, slot % 3] = edge
    return pairs[: edge + 1].copy(), met[: edge + 1].copy(), of_face


@kernel
def _repeated(corners: Any, vertices: Any) -> Any:
    order = np.arange(len(corners))
    for k in range(2, -1, -1):
        order = _sorted_by(corners[:, k], order, vertices)
    found = np.zeros(len(corners), dtype=np.bool_)
    for at in range(1, len(order)):
        one, other = order[at], order[at - 1]
        found[one] = (
            corners[one, 0] == corners[other, 0]
            and corners[one, 1] == corners[other, 1]
            and corners[one, 2] == corners[other, 2]
        )
    return found


@kernel
def _linked(count: Any, first: Any, second: Any) -> Any:
    parent = np.arange(count)
    for e in range(len(first)):
        a, b = root_of(parent, first[e]), root_of(parent, second[e])
        parent[max(a, b)] = min(a, b)
    number = np.zeros(count, dtype=np.int32)
    found = 0
    for v in range(count):
        root = root_of(parent, v)
        if root == v:
            number[v] = found
            found += 1
        else:
            number[v] = number[root]
    return number
