"""Graphs as lists of pairs: connected components, and Louvain clusters by modularity."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray


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


Ints = NDArray[np.int32]

Floats = NDArray[np.float64]

Vertices = NDArray[np.integer]

# number of vertices, first, second, weight, resolution, seed -> (n,) cluster of each vertex
Partition = Callable[[int, Vertices, Vertices, Floats, float, int], Ints]


def louvain(
    count: int, first: Vertices, second: Vertices, weight: Floats, resolution: float, seed: int
) -> Ints:
    """The clusters that networkit finds: Louvain (Blondel et al. 2008) with refinement.

    Parameters
    ----------
    count : number of vertices.
    first, second, weight : (E,) edges, each pair once, weights > 0.
    resolution : factor of the modularity's null model. Larger means more and smaller clusters
        (the published α runs the other way: it grows with the clusters).

    Returns
    -------
    (count,) int32, clusters numbered from 0 in the order of their first vertex; a vertex without
    an edge is alone.
    """
    if len(weight) == 0:
        return np.arange(count, dtype=np.int32)
    import networkit

    with _one_thread():
        networkit.setSeed(seed, False)
        graph = networkit.GraphFromCoo(
            (weight, (first.astype(np.uint64), second.astype(np.uint64))),
            n=count, weighted=True, directed=False,
        )  # fmt: skip
        method = networkit.community.PLM(graph, refine=True, gamma=resolution, par="none")
        method.run()
        found = np.asarray(method.getPartition().getVector(), dtype=np.int64)
    return renumber(found)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Networkit's number of threads belongs to the whole process: give it back as it was."""
    import networkit

    threads = networkit.getMaxNumberOfThreads()
    networkit.setNumberOfThreads(1)
    try:
        yield
    finally:
        networkit.setNumberOfThreads(threads)
