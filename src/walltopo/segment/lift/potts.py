"""Louvain with the constant Potts objective: clusters do not depend on the size of the scene.

Modularity compares a cluster with the whole graph: the larger the scene, the more readily two
neighbouring objects merge by one bad mask (its resolution limit). The constant Potts model
(Traag, Van Dooren, Nesterov, Phys. Rev. E 2011) maximises the sum over pairs inside clusters of
weight - cohesion: two clusters merge if the mean weight between them exceeds `cohesion`, however
many others there are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.graphs import renumber
from walltopo.geometry.kernels import kernel

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]


def potts_clusters(count: int, first: Ints, second: Ints, weight: Floats, cohesion: float) -> Ints:
    """Clusters of a graph; deterministic (vertices are visited in their order).

    Parameters
    ----------
    count : number of vertices.
    first, second, weight : (E,) edges, each pair once, weights in [0, 1]; pairs without an edge
        count as weight 0.
    cohesion : in (0, 1): larger gives more and smaller clusters.

    Returns
    -------
    (count,) int32, numbered from 0 in the order of their first vertex.
    """
    member = np.arange(count, dtype=np.int64)
    size: Floats = np.ones(count, dtype=np.float64)
    p, q, w = first.astype(np.int64), second.astype(np.int64), weight.astype(np.float64)
    while True:
        starts, ends, weights = _adjacency(len(size), p, q, w)
        cluster = np.arange(len(size))
        _move(starts, ends, weights, size, cohesion, cluster, size.copy(), np.zeros(len(size)))
        _, found = np.unique(cluster, return_inverse=True)
        groups = int(found.max(initial=-1)) + 1
        member = found[member]
        if groups == len(size):
            return renumber(member)
        size = np.bincount(found, size, minlength=groups).astype(np.float64)
        # Edges between the new vertices; those inside one no longer matter.
        a, b = np.minimum(found[p], found[q]), np.maximum(found[p], found[q])
        between = a != b
        pairs, place = np.unique(a[between] * groups + b[between], return_inverse=True)
        w = np.bincount(place, w[between], minlength=len(pairs)).astype(np.float64)
        p, q = pairs // groups, pairs % groups


@kernel
def _adjacency(count: Any, p: Any, q: Any, w: Any) -> Any:
    """Neighbours of each vertex, those after it first: starts, ends, weights."""
    starts = np.zeros(count + 1, dtype=np.int64)
    for e in range(len(p)):
        starts[p[e] + 1] += 1
        starts[q[e] + 1] += 1
    for v in range(count):
        starts[v + 1] += starts[v]
    place = starts[:-1].copy()
    ends, weights = np.zeros(2 * len(p), dtype=np.int64), np.zeros(2 * len(p))
    for source, target in ((p, q), (q, p)):
        for e in range(len(p)):
            at = place[source[e]]
            ends[at], weights[at] = target[e], w[e]
            place[source[e]] += 1
    return starts, ends, weights


@kernel
def _move(
    starts: Any,
    ends: Any,
    weights: Any,
    size: Any,
    cohesion: Any,
    cluster: Any,
    total: Any,
    to: Any,
) -> None:
    """Move vertices to the neighbouring cluster that gains most, until none gains.

    Parameters
    ----------
    cluster : (n,) of each vertex, changed in place; total : (n,) size of each cluster, kept up;
    to : (n,) zeros.
    """
    count = len(size)
    moved = True
    while moved:
        moved = False
        for v in range(count):
            own = cluster[v]
            for k in range(starts[v], starts[v + 1]):
                to[cluster[ends[k]]] += weights[k]
            total[own] -= size[v]
            best, target = to[own] - cohesion * size[v] * total[own], own
            for k in range(starts[v], starts[v + 1]):
                other = cluster[ends[k]]
                gain = to[other] - cohesion * size[v] * total[other]
                if gain > best + 1e-12:
                    best, target = gain, other
            total[target] += size[v]
            if target != own:
                cluster[v] = target
                moved = True
            for k in range(starts[v], starts[v + 1]):
                to[cluster[ends[k]]] = 0.0
            to[own] = 0.0
