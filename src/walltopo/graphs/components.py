"""What hangs together, and numbers that do not depend on how it was found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["components", "renumber"]


def components(
    count: int, first: NDArray[np.integer], second: NDArray[np.integer]
) -> NDArray[np.int32]:
    """The connected parts of an undirected graph.

    Parameters
    ----------
    count : number of vertices.
    first, second : (E,) edges; the same pair may come more than once.

    Returns
    -------
    (count,) int32, parts numbered from 0 in the order of their first vertex.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(first), np.bool_), (first, second)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def renumber(groups: NDArray[np.integer]) -> NDArray[np.int32]:
    """Number groups from 0 in the order of their first member, so that equal ones are equal."""
    _, first, inverse = np.unique(groups, return_index=True, return_inverse=True)
    rank = np.zeros(len(first), dtype=np.int32)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first), dtype=np.int32)
    return rank[inverse]
