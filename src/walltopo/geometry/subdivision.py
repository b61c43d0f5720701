"""Split triangles at new vertices on their edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import Edges, edge_lengths, edges_of, side_lengths


def split_faces(faces: NDArray[np.int32], middle: NDArray[np.int64]) -> NDArray[np.int32]:
    """Split triangles at new vertices; a manifold mesh stays manifold.

    Parameters
    ----------
    faces : (F, 3).
    middle : (F, 3) new vertex on the edge from corner k to corner k + 1, -1 = none. All triangles
        at an edge must agree.
    """
    count = (middle >= 0).sum(axis=1)
    # Rotate corners so that one new vertex lies on the first edge, two on the first and second.
    first = np.where(count == 1, (middle >= 0).argmax(axis=1), (middle < 0).argmax(axis=1) + 1)
    turn = (first[:, None] + np.arange(3)) % 3
    u, v, w = np.take_along_axis(faces, turn, axis=1).T
    p, q, r = np.take_along_axis(middle, turn, axis=1).T
    one, two, three = (count == n for n in (1, 2, 3))
    pieces = [
        faces[count == 0],
        np.stack([u, p, w], axis=1)[one],
        np.stack([p, v, w], axis=1)[one],
        np.stack([p, v, q], axis=1)[two | three],
        np.stack([u, p, q], axis=1)[two],
        np.stack([u, q, w], axis=1)[two],
        np.stack([u, p, r], axis=1)[three],
        np.stack([q, w, r], axis=1)[three],
        np.stack([p, q, r], axis=1)[three],
    ]
    return np.concatenate(pieces).astype(np.int32)


def drop_long_triangles(mesh: Mesh, longest: float) -> Mesh:
    """Drop the triangles with an edge longer than `longest`; all vertices stay."""
    return Mesh(mesh.vertices, mesh.faces[side_lengths(mesh).max(axis=1) <= longest])


def split_long_edges(mesh: Mesh, longest: float) -> Mesh:
    """Halve the edges longer than `longest` until none is left; the surface does not move.

    Parameters
    ----------
    mesh : a manifold mesh stays manifold, because an edge is halved in all its triangles.
    longest : maximum edge length, world units.
    """
    while True:
        shorter = halve_edges(mesh, longest)
        if len(shorter.vertices) == len(mesh.vertices):
            return mesh
        mesh = shorter


def halve_edges(mesh: Mesh, longest: float, border: bool = True) -> Mesh:
    """Halve the edges longer than `longest` once; existing vertices keep their indices.

    Parameters
    ----------
    border : whether boundary edges are halved too.
    """
    edges = edges_of(mesh.faces)
    split = edge_lengths(mesh.vertices, edges) > longest
    if not border:
        split &= edges.count > 1
    vertices, middle = _halve_edges(mesh, edges, split)
    return Mesh(vertices, split_faces(mesh.faces, middle))


def _halve_edges(
    mesh: Mesh, edges: Edges, split: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the vertices with the middles of the `split` edges, and `split_faces`'s `middle`."""
    a, b = (mesh.vertices[end] for end in edges.pairs[split].T)
    number = np.full(len(split), -1, dtype=np.int64)
    number[split] = len(mesh.vertices) + np.arange(len(a))
    return np.concatenate([mesh.vertices, 0.5 * (a + b)]), number[edges.of_face]


def split_long_edges_with_uv(
    mesh: Mesh, uv: NDArray[np.float64], longest: float
) -> tuple[Mesh, NDArray[np.float64]]:
    """Halve long edges as `split_long_edges`; the texture does not move on the surface.

    Parameters
    ----------
    uv : (F, 3, 2) texture coordinates of the corners.
    """
    while True:
        edges = edges_of(mesh.faces)
        split = edge_lengths(mesh.vertices, edges) > longest
        if not split.any():
            return mesh, uv
        vertices, of_face = _halve_edges(mesh, edges, split)
        # Each corner and each halved edge of each triangle has a texture coordinate of its own.
        rows, k = np.nonzero(of_face >= 0)
        own = np.full(of_face.shape, -1, dtype=np.int64)
        own[rows, k] = uv.size // 2 + np.arange(len(rows))
        halves = 0.5 * (uv[rows, k] + uv[rows, (k + 1) % 3])
        corners = np.arange(uv.size // 2, dtype=np.int32).reshape(-1, 3)
        all_uv = np.concatenate([uv.reshape(-1, 2), halves])
        uv = all_uv[split_faces(corners, own)]
        mesh = Mesh(vertices, split_faces(mesh.faces, of_face))
