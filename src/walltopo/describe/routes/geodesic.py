"""Shortest paths along the wall between holds, by edge flips.

Source: N. Sharp, K. Crane, "You Can Find Geodesic Paths in Triangle Meshes by Just Flipping
Edges", 2020 (FlipOut), in `potpourri3d`. FlipOut straightens the shortest edge path; the
result is an exact geodesic of the proxy mesh.

Where two connected components of the wall come within `bridge_gap` of each other, edges bridge
them. The path is solved on each component and crosses the gap in a straight line. Components
farther apart are not connected: the length is infinite, and no edge of the graph of holds spans
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.describe.routes.proxy import Proxy

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CHUNK = 256  # pairs per solver instance; fixed, so that results do not depend on the threads


def flat_length(path: Floats, ratio: float) -> float:
    """Return the length of a polyline (n, 3) whose z component is multiplied by `ratio`."""
    steps = np.diff(path, axis=0) * np.array([1.0, 1.0, ratio])
    return float(np.linalg.norm(steps, axis=1).sum())


@dataclass(eq=False)
class Geodesics:
    """A solver of paths between vertices of one proxy; not shared between threads.

    Parameters
    ----------
    proxy : the wall.
    bridge_gap : components this near are connected, in the proxy's unit.
    """

    proxy: Proxy
    bridge_gap: float = 0.0

    def __post_init__(self) -> None:
        import potpourri3d

        self._solver = potpourri3d.EdgeFlipGeodesicSolver(self.proxy.vertices, self.proxy.faces)

    def path(self, start: int, end: int) -> Floats | None:
        """Return the (n, 3) polyline between two vertices, or None if they are not connected."""
        if start == end:
            return self.proxy.vertices[[start, start]]
        if self.proxy.part[start] == self.proxy.part[end]:
            return np.asarray(self._solver.find_geodesic_path(start, end), dtype=np.float64)
        return self._across(start, end)

    def _across(self, start: int, end: int) -> Floats | None:
        """Return a path that crosses gaps: the shortest edge path with straightened legs."""
        from scipy.sparse.csgraph import dijkstra

        distance, before = dijkstra(
            self._graph(), directed=False, indices=start, return_predecessors=True
        )
        if not np.isfinite(distance[end]):
            return None
        nodes = [end]
        while nodes[-1] != start:
            nodes.append(int(before[nodes[-1]]))
        nodes.reverse()
        legs: list[Floats] = []
        first = 0
        for k in range(1, len(nodes) + 1):
            # A leg ends where the next node lies on another component.
            if k == len(nodes) or self.proxy.part[nodes[k]] != self.proxy.part[nodes[k - 1]]:
                leg = self.path(nodes[first], nodes[k - 1])
                assert leg is not None  # both ends are on one component
                legs.append(leg)
                first = k
        return np.vstack(legs)

    def _graph(self) -> object:
        """Return the edges of the mesh and the bridges, weighted by length."""
        from scipy.sparse import coo_matrix

        if not hasattr(self, "_edge_graph"):
            points, faces = self.proxy.vertices, self.proxy.faces
            pairs = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
            pairs = np.unique(np.sort(np.vstack([pairs, self._bridge_pairs()]), axis=1), axis=0)
            length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
            n = len(points)
            graph = coo_matrix((np.maximum(length, 1e-12), (pairs[:, 0], pairs[:, 1])), (n, n))
            self._edge_graph = graph.tocsr()
        return self._edge_graph

    def _bridge_pairs(self) -> Ints:
        """Return (n, 2) pairs of each vertex with the nearest one of each other component."""
        from scipy.spatial import cKDTree

        points, part = self.proxy.vertices, self.proxy.part
        found = [np.zeros((0, 2), dtype=np.int64)]
        if self.bridge_gap > 0:
            for number in range(int(part.max()) + 1):
                own, others = np.flatnonzero(part == number), np.flatnonzero(part != number)
                if len(others) == 0:
                    continue
                gap, near = cKDTree(points[others]).query(
                    points[own], distance_upper_bound=self.bridge_gap
                )
                hit = np.isfinite(gap)
                found.append(np.column_stack([own[hit], others[near[hit]]]))
        return np.vstack(found)


def pair_lengths(
    proxy: Proxy,
    pairs: Sequence[tuple[int, int]] | Ints,
    ratio: float,
    bridge_gap: float = 0.0,
    threads: int = 1,
) -> Floats:
    """Return the flattened path length of each pair of anchors.

    Parameters
    ----------
    pairs : (P, 2) int, anchor numbers.
    ratio : factor on the vertical part of a path.
    threads : workers; the result is the same for any number, because the pairs are cut into
        fixed chunks and each chunk has its own solver.

    Returns
    -------
    (P,) float64, inf if no path exists.
    """
    pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)

    def solve(chunk: Ints) -> list[float]:
        solver = Geodesics(proxy, bridge_gap)
        lengths: list[float] = []
        for one, two in chunk.tolist():
            path = solver.path(int(proxy.anchors[one]), int(proxy.anchors[two]))
            lengths.append(np.inf if path is None else flat_length(path, ratio))
        return lengths

    chunks = [pairs[k : k + CHUNK] for k in range(0, len(pairs), CHUNK)]
    if threads <= 1 or len(chunks) <= 1:
        results = [solve(chunk) for chunk in chunks]
    else:
        with ThreadPoolExecutor(threads) as pool:
            results = list(pool.map(solve, chunks))
    return np.array([length for chunk in results for length in chunk], dtype=np.float64)
