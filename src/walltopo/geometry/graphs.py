"""Group items: connected components, union-find over edges, graph clusters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import kernel


def components(
    count: int, first: NDArray[np.integer], second: NDArray[np.integer]
) -> NDArray[np.int32]:
    """Return the connected components of an undirected graph.

    Parameters
    ----------
    count : number of vertices.
    first, second : (E,) edges; a pair may be repeated.

    Returns
    -------
    (count,) int32, components numbered from 0 in the order of their first vertex.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(first), np.bool_), (first, second)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def renumber(groups: NDArray[np.integer]) -> NDArray[np.int32]:
    """Number groups from 0 in the order of their first member, so that equal partitions are
    equal."""
    _, first, inverse = np.unique(groups, return_index=True, return_inverse=True)
    rank = np.zeros(len(first), dtype=np.int32)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first), dtype=np.int32)
    return rank[inverse]


Ints = NDArray[np.int32]

Floats = NDArray[np.float64]

Vertices = NDArray[np.integer]

# Maps (number of vertices, first, second, weight, resolution, seed) to each vertex's cluster (n,).
Partition = Callable[[int, Vertices, Vertices, Floats, float, int], Ints]


def louvain(
    count: int, first: Vertices, second: Vertices, weight: Floats, resolution: float, seed: int
) -> Ints:
    """Cluster a graph by networkit's Louvain method (Blondel et al. 2008) with refinement.

    Parameters
    ----------
    count : number of vertices.
    first, second, weight : (E,) edges, each pair once, weights > 0.
    resolution : factor of the modularity's null model. A larger value gives more and smaller
        clusters (the published α is inverse: it grows with the clusters).

    Returns
    -------
    (count,) int32, clusters numbered from 0 in the order of their first vertex. A vertex without
    edges is its own cluster.
    """
    if len(weight) == 0:
        return np.arange(count, dtype=np.int32)
    import networkit

    with _one_thread():
        networkit.setSeed(seed, False)
        graph = networkit.GraphFromCoo(
            (weight, (first.astype(np.uint64), second.astype(np.uint64))),
            n=count,
            weighted=True,
            directed=False,
        )
        method = networkit.community.PLM(graph, refine=True, gamma=resolution, par="none")
        method.run()
        found = np.asarray(method.getPartition().getVector(), dtype=np.int64)
    return renumber(found)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Limit networkit to one thread in the block; the setting is global, so restore it
    afterwards."""
    import networkit

    threads = networkit.getMaxNumberOfThreads()
    networkit.setNumberOfThreads(1)
    try:
        yield
    finally:
        networkit.setNumberOfThreads(threads)


def grouped_edges(faces: NDArray[np.integer]) -> tuple[Ints, Ints, Ints]:
    """Return the undirected edges of (F, 3) faces.

    Returns
    -------
    (E, 2) int32 vertices of each edge, smaller first, ascending; (E,) int32 number of faces at each
    edge; (F, 3) int32 index of the edge from corner k to corner k + 1.
    """
    return _edges(np.ascontiguousarray(faces, np.int32), int(faces.max(initial=-1)) + 1)


def duplicate_faces(faces: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Return (F,) whether an earlier face has the same three vertices."""
    corners = np.array(faces, np.int32, order="C")
    corners.sort(axis=1)
    return _repeated(corners, int(faces.max(initial=-1)) + 1)


def symmetric_matrix(
    count: int,
    first: NDArray[np.integer],
    second: NDArray[np.integer],
    weight: NDArray[np.number],
) -> Any:
    """Return the sparse (count, count) matrix of the weights of undirected edges.

    Parameters
    ----------
    first, second, weight : (E,) edges; the weights of a repeated pair, in either direction, add up.
    """
    from scipy.sparse import coo_matrix

    graph = coo_matrix((weight, (first, second)), shape=(count, count)).tocsr()
    return graph + graph.T


def linked_components(count: int, first: NDArray[np.integer], second: NDArray[np.integer]) -> Ints:
    """Return (count,) the component of each vertex, numbered in the order of first vertices.

    Parameters
    ----------
    first, second : (E,) edges; a pair may be repeated.
    """
    parent = np.arange(count, dtype=np.int32)
    return _linked(
        parent, np.ascontiguousarray(first, np.int32), np.ascontiguousarray(second, np.int32)
    )


@kernel
def _sorted_by(keys: Any, order: Any, max_key: Any) -> Any:
    """Sort `order` stably by keys below `max_key`, by counting sort."""
    place = np.zeros(max_key + 1, dtype=np.int32)
    for key in keys:
        place[key + 1] += 1
    for key in range(max_key):
        place[key + 1] += place[key]
    found = np.zeros_like(order)
    for item in order:
        found[place[keys[item]]] = item
        place[keys[item]] += 1
    return found


@kernel
def _ends(faces: Any, upper: Any) -> Any:
    """Return (3 F,) the higher (`upper`) or lower vertex of each half-edge."""
    found = np.zeros(3 * len(faces), dtype=np.int32)
    for f in range(len(faces)):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            found[3 * f + k] = max(a, b) if upper else min(a, b)
    return found


@kernel
def _starts_edge(slots: Any, low: Any, high: Any, at: Any) -> Any:
    """Return whether a half-edge, in the order `slots`, has other vertices than the one before."""
    one, other = slots[at], slots[at - 1]
    return at == 0 or low[one] != low[other] or high[one] != high[other]


@kernel
def _edges(faces: Any, vertices: Any) -> Any:
    count = 3 * len(faces)
    high = _ends(faces, True)
    slots = _sorted_by(high, np.arange(count, dtype=np.int32), vertices)
    low = _ends(faces, False)
    slots = _sorted_by(low, slots, vertices)
    edges = 0
    for at in range(count):
        edges += _starts_edge(slots, low, high, at)
    pairs = np.zeros((edges, 2), dtype=np.int32)
    face_count = np.zeros(edges, dtype=np.int32)
    of_face = np.zeros((len(faces), 3), dtype=np.int32)
    edge = -1
    for at in range(count):
        slot = slots[at]
        if _starts_edge(slots, low, high, at):
            edge += 1
            pairs[edge, 0], pairs[edge, 1] = low[slot], high[slot]
        face_count[edge] += 1
        of_face[slot // 3, slot % 3] = edge
    return pairs, face_count, of_face


@kernel
def _repeated(corners: Any, vertices: Any) -> Any:
    order = np.arange(len(corners), dtype=np.int32)
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
def _linked(parent: Any, first: Any, second: Any) -> Any:
    for e in range(len(first)):
        join_components(parent, first[e], second[e])
    return number_components(parent)


@kernel
def number_components(parent: Any) -> Any:
    """Return the component of each item, numbered in the order of first items."""
    number = np.zeros(len(parent), dtype=np.int32)
    found = 0
    for v in range(len(parent)):
        root = root_of(parent, v)
        if root == v:
            number[v] = found
            found += 1
        else:
            number[v] = number[root]
    return number


@kernel
def root_of(parent: Any, k: Any) -> Any:
    """Return the root (lowest member) of k's component, with path halving."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@kernel
def join_components(parent: Any, one: Any, other: Any) -> None:
    """Join the components of two items."""
    a, b = root_of(parent, one), root_of(parent, other)
    parent[max(a, b)] = min(a, b)
