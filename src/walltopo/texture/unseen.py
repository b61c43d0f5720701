"""Colours for triangles that no photo saw: those of their surroundings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["spread_colours", "unseen_cells"]

Floats = NDArray[np.float64]

_CELL = 2


def unseen_cells(count: int) -> tuple[NDArray[np.float32], int]:
    """A square of cells, one per triangle: (count, 3, 2) corners, and the square's side."""
    columns = int(np.ceil(np.sqrt(count)))
    index = np.arange(count)
    if count == 0:
        return np.zeros((0, 3, 2), dtype=np.float32), 0
    corner = np.stack([index % columns, index // columns], axis=1).astype(np.float32) * _CELL
    triangle = np.array([[0.75, 0.75], [1.25, 0.75], [0.75, 1.25]], dtype=np.float32)
    return corner[:, None, :] + triangle, columns * _CELL


def spread_colours(
    faces: NDArray[np.int32],
    vertex_count: int,
    known_vertex: NDArray[np.int64],
    known_colour: Floats,
) -> Floats:
    """(V, 3) colours: the known ones, and around them the mean of neighbours, ring by ring.

    Parameters
    ----------
    faces : (F, 3).
    vertex_count : V.
    known_vertex, known_colour : (N,) and (N, 3); a vertex named twice gets the mean. Parts of
        the mesh without any get the mean of all.
    """
    from scipy.sparse import coo_matrix

    total = np.zeros((vertex_count, 3))
    number = np.zeros(vertex_count)
    np.add.at(total, known_vertex, known_colour)
    np.add.at(number, known_vertex, 1.0)
    colour = total / np.maximum(number, 1.0)[:, None]
    known = number > 0
    i = np.concatenate([faces[:, 0], faces[:, 1], faces[:, 2]])
    j = np.concatenate([faces[:, 1], faces[:, 2], faces[:, 0]])
    shape = (vertex_count, vertex_count)
    graph = coo_matrix((np.ones(len(i), dtype=np.float32), (i, j)), shape=shape).tocsr()
    graph = graph + graph.T
    while True:
        unknown = np.flatnonzero(~known)
        if len(unknown) == 0:
            return colour
        rows = graph[unknown]
        votes = rows @ known.astype(np.float64)
        reached = votes > 0
        if not reached.any():
            colour[unknown] = known_colour.mean(axis=0)
            return colour
        weighted = rows[reached] @ np.where(known[:, None], colour, 0.0)
        colour[unknown[reached]] = weighted / votes[reached, None]
        known[unknown[reached]] = True
