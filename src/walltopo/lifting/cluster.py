"""Clustering of projections: Louvain on a weighted graph."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["Partition", "louvain", "renumber"]

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]

# number of vertices, first, second, weight, resolution, seed -> (n,) cluster of each vertex
Partition = Callable[[int, Ints, Ints, Floats, float, int], Ints]


def louvain(
    count: int, first: Ints, second: Ints, weight: Floats, resolution: float, seed: int
) -> Ints:
    """Louvain (Blondel et al. 2008) by networkit, on one thread, seeded.

    Parameters
    ----------
    count : number of vertices.
    first, second, weight : (E,) edges, each pair once, weights > 0.
    resolution : factor of the modularity's null model. Larger means more and smaller clusters
        (the published α runs the other way: it grows with the clusters).

    Returns
    -------
    (count,) int32, clusters numbered from 0 in the order of their first vertex.
    """
    if len(weight) == 0:
        return np.arange(count, dtype=np.int32)
    import networkit

    threads = networkit.getMaxNumberOfThreads()
    networkit.setNumberOfThreads(1)
    networkit.setSeed(seed, False)
    try:
        graph = networkit.GraphFromCoo(
            (weight, (first.astype(np.uint64), second.astype(np.uint64))),
            n=count, weighted=True, directed=False,
        )  # fmt: skip
        method = networkit.community.PLM(graph, refine=True, gamma=resolution, par="none")
        method.run()
        found = np.asarray(method.getPartition().getVector(), dtype=np.int64)
    finally:
        networkit.setNumberOfThreads(threads)
    return renumber(found)


def renumber(clusters: NDArray[np.int64]) -> Ints:
    """Number clusters from 0 in the order of their first member."""
    _, first, inverse = np.unique(clusters, return_index=True, return_inverse=True)
    rank = np.zeros(len(first), dtype=np.int32)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first), dtype=np.int32)
    return rank[inverse]
