"""Edges, parts and borders of a triangle mesh: the facts that cleaning and checking share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Edges", "boundary_loops", "compact", "doubled", "edges_of", "fans", "parts"]

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Edges:
    """Undirected edges of a mesh.

    Parameters
    ----------
    pairs : (E, 2) int64 vertices, smaller first.
    count : (E,) faces at each edge; 1 = border, > 2 = not manifold.
    of_face : (F, 3) index of the edge from corner k to corner k + 1.
    """

    pairs: NDArray[np.int64]
    count: NDArray[np.int64]
    of_face: NDArray[np.int64]


def edges_of(faces: Faces) -> Edges:
    """The undirected edges of (F, 3) faces."""
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    low, high = directed.min(axis=1).astype(np.int64), directed.max(axis=1).astype(np.int64)
    size = int(faces.max(initial=0)) + 1
    keys, inverse, count = np.unique(low * size + high, return_inverse=True, return_counts=True)
    return Edges(np.stack(np.divmod(keys, size), axis=1), count, inverse.reshape(-1, 3))


def parts(faces: Faces, edges: Edges | None = None) -> NDArray[np.int32]:
    """(F,) number of the part of each face; faces that share an edge are of one part."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = edges if edges is not None else edges_of(faces)
    n, e = len(faces), len(edges.pairs)
    rows = np.repeat(np.arange(n), 3)
    columns = edges.of_face.ravel() + n
    graph = coo_matrix((np.ones(3 * n, dtype=np.bool_), (rows, columns)), shape=(n + e, n + e))
    return connected_components(graph, directed=False)[1][:n]


def fans(faces: Faces, edges: Edges | None = None) -> NDArray[np.int32]:
    """(F, 3) number of the fan of each corner: the corners at one vertex that are linked by
    manifold edges. A vertex with more than one fan is not manifold."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = edges if edges is not None else edges_of(faces)
    slot = np.arange(3 * len(faces), dtype=np.int64)
    edge = edges.of_face.ravel()
    order = np.argsort(edge, kind="stable")
    manifold = edges.count[edge[order]] == 2
    first, second = slot[order][manifold].reshape(-1, 2).T
    # Slot s is the directed edge from corner s to the next corner of the same face. Both faces
    # of an edge share both its ends: link the corners that are the same vertex.
    following = slot - slot % 3 + (slot + 1) % 3
    flat = faces.ravel()
    aligned = flat[first] == flat[second]
    mate_start = np.where(aligned, second, following[second])
    mate_stop = np.where(aligned, following[second], second)
    rows = np.concatenate([first, following[first]])
    columns = np.concatenate([mate_start, mate_stop])
    n = len(slot)
    graph = coo_matrix((np.ones(len(rows), dtype=np.bool_), (rows, columns)), shape=(n, n))
    return connected_components(graph, directed=False)[1].reshape(-1, 3)


def doubled(faces: Faces) -> NDArray[np.bool_]:
    """(F,) whether an earlier face has the same three vertices."""
    corners = np.sort(faces, axis=1)
    order = np.lexsort((corners[:, 2], corners[:, 1], corners[:, 0]))
    ordered = corners[order]
    again = np.zeros(len(faces), dtype=np.bool_)
    again[order[1:]] = (ordered[1:] == ordered[:-1]).all(axis=1)
    return again


def compact(vertices: Floats, faces: NDArray[np.integer]) -> tuple[Floats, Faces]:
    """Vertices that some face uses, and the faces with the new numbers."""
    used, inverse = np.unique(faces, return_inverse=True)
    return vertices[used], inverse.reshape(-1, 3).astype(np.int32)


def boundary_loops(faces: Faces, edges: Edges | None = None) -> list[NDArray[np.int64]]:
    """Closed chains of border vertices, in the direction of the faces' own edges.

    The mesh must be manifold at its vertices (see `fans`); chains that meet a non-manifold
    vertex are left out.
    """
    edges = edges if edges is not None else edges_of(faces)
    border = (edges.count == 1)[edges.of_face]
    starts = faces[border]
    stops = np.roll(faces, -1, axis=1)[border]
    follow = dict(zip(starts.tolist(), stops.tolist(), strict=True))
    if len(follow) != len(starts):
        doubled = np.flatnonzero(np.bincount(starts) > 1).tolist()
        for vertex in doubled:
            follow.pop(vertex, None)
    loops: list[NDArray[np.int64]] = []
    while follow:
        first, current = follow.popitem()
        loop = [first]
        while current != first and current in follow:
            loop.append(current)
            current = follow.pop(current)
        if current == first and len(loop) >= 3:
            loops.append(np.array(loop, dtype=np.int64))
    return loops
