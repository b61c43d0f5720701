"""Edges, fans and parts of a triangle mesh: what cleaning and checking share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.grouping import grouped_edges, linked, repeated

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


def edges_of(faces: NDArray[np.integer]) -> Edges:
    """The undirected edges of (F, 3) faces."""
    return Edges(*grouped_edges(faces))


def vertex_parts(faces: NDArray[np.integer], count: int) -> NDArray[np.int32]:
    """(count,) number of the part of each vertex; faces that share a vertex are of one part."""
    first, second = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    return linked(count, first.astype(np.int64), second.astype(np.int64))


def fans(faces: Faces, edges: Edges | None = None) -> NDArray[np.int32]:
    """(F, 3) number of the fan of each corner: the corners at one vertex that are linked by
    manifold edges. A vertex with more than one fan is not manifold."""
    edges = edges if edges is not None else edges_of(faces)
    edge = edges.of_face.ravel()
    slots = np.arange(len(edge))
    # Of values for one place the last stays.
    first, second = np.zeros((2, len(edges.count)), dtype=np.int64)
    first[edge[::-1]], second[edge] = slots[::-1], slots
    shared = edges.count == 2
    return glued_fans(faces, first[shared], second[shared])


def glued_fans(
    faces: NDArray[np.integer], first: NDArray[np.int64], second: NDArray[np.int64]
) -> NDArray[np.int32]:
    """(F, 3) number of the fan of each corner, where faces hang together only as told.

    Parameters
    ----------
    first, second : (n,) half-edges that are one edge; 3 f + k runs from corner k of face f to
        its corner k + 1.
    """
    slot = np.arange(3 * len(faces), dtype=np.int64)
    following = slot - slot % 3 + (slot + 1) % 3
    # Both faces of an edge share both its ends: link the corners that are the same vertex.
    flat = faces.ravel()
    aligned = flat[first] == flat[second]
    mate_start = np.where(aligned, second, following[second])
    mate_stop = np.where(aligned, following[second], second)
    rows = np.concatenate([first, following[first]])
    columns = np.concatenate([mate_start, mate_stop])
    return linked(len(slot), rows, columns).reshape(-1, 3)


def opposed_pairs(faces: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(n,) and (n,) half-edges that run against each other along one edge.

    Each edge gives its first of either direction; a lone or third one has no partner.
    """
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel()
    low, high, forward = np.minimum(start, end), np.maximum(start, end), start < end
    key = low * (int(faces.max(initial=0)) + 1) + high
    order = np.lexsort((~forward, key))
    key, forward = key[order], forward[order]
    directed = key * 2 + forward
    head = np.flatnonzero(np.r_[True, directed[1:] != directed[:-1]])
    first, key, forward = order[head], key[head], forward[head]
    both = np.flatnonzero((key[1:] == key[:-1]) & forward[:-1])
    return first[both], first[both + 1]


def split_fans(mesh: Mesh, fan: Faces | None = None) -> Mesh:
    """Give each fan its own vertex: where two surfaces touch in a vertex they come apart.

    Parameters
    ----------
    fan : (F, 3) as of `fans`, its default, or of `glued_fans`.
    """
    fan = fans(mesh.faces) if fan is None else fan
    flat = fan.ravel()
    corner = np.zeros(int(flat.max(initial=-1)) + 1, dtype=np.int64)
    corner[flat] = mesh.faces.ravel()
    return Mesh(mesh.vertices[corner], fan)


def doubled(faces: NDArray[np.integer]) -> NDArray[np.bool_]:
    """(F,) whether an earlier face has the same three vertices."""
    return repeated(faces)


def compact(vertices: Floats, faces: NDArray[np.integer]) -> tuple[Floats, Faces]:
    """Vertices that some face uses, and the faces with the new numbers."""
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[faces] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    return vertices[used], number[faces].astype(np.int32)
