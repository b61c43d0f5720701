"""Which corners of triangles are one vertex of a renderer: same place, same values there."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import kernel


def shared_corners(
    faces: NDArray[np.integer], values: NDArray[np.integer], vertices: int
) -> tuple[NDArray[np.int32], NDArray[np.uint32]]:
    """Number the distinct pairs of a vertex and a value among the corners of triangles.

    Parameters
    ----------
    faces : (F, 3), indices below `vertices`.
    values : (F, 3) not negative, what a corner is besides its vertex.

    Returns
    -------
    (N,) the first corner of each pair, an index into the 3 F corners; pairs are in the order of
    their vertices, and at one vertex of their values. (F, 3) the pair of each corner.
    """
    return _shared(
        np.ascontiguousarray(faces, np.int32), np.ascontiguousarray(values, np.uint64), vertices
    )


@kernel
def _shared(faces: Any, values: Any, vertices: Any) -> Any:
    corners = 3 * len(faces)
    vertex, value = faces.ravel(), values.ravel()
    # Corners grouped by vertex, each group in their order.
    starts = np.zeros(vertices + 1, dtype=np.int32)
    for k in range(corners):
        starts[vertex[k] + 1] += 1
    for v in range(vertices):
        starts[v + 1] += starts[v]
    order = np.zeros(corners, dtype=np.int32)
    place = starts[:-1].copy()
    for k in range(corners):
        order[place[vertex[k]]] = k
        place[vertex[k]] += 1
    first = np.zeros(corners, dtype=np.int32)
    number = np.zeros((len(faces), 3), dtype=np.uint32)
    count = 0
    for v in range(vertices):
        # By insertion, which keeps the order of equal ones: a vertex has some six corners.
        for i in range(starts[v] + 1, starts[v + 1]):
            corner, j = order[i], i
            while j > starts[v] and value[order[j - 1]] > value[corner]:
                order[j] = order[j - 1]
                j -= 1
            order[j] = corner
        for i in range(starts[v], starts[v + 1]):
            corner = order[i]
            if i == starts[v] or value[corner] != value[order[i - 1]]:
                first[count] = corner
                count += 1
            number[corner // 3, corner % 3] = count - 1
    return first[:count].copy(), number
