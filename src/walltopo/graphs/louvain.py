"""Clusters of a weighted graph by Louvain: seeded, on one thread."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from walltopo.graphs.components import renumber

__all__ = ["Partition", "louvain"]

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
