"""Triangles split at new vertices on their edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import edges_of


def halved(faces: NDArray[np.int32], middle: NDArray[np.int64]) -> NDArray[np.int32]:
    """The triangles cut at new vertices; what is manifold stays so.

    Parameters
    ----------
    faces : (F, 3).
    middle : (F, 3) new vertex on the edge from corner k to corner k + 1, -1 = none. An edge has it
        in all its triangles or in none.
    """
    count = (middle >= 0).sum(axis=1)
    # Turned so that one new vertex lies on the first edge, two on the first and second.
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


def drop_wide(mesh: Mesh, longest: float) -> Mesh:
    """Without the triangles that have an edge longer than `longest`; all vertices stay."""
    return Mesh(mesh.vertices, mesh.faces[_lengths(mesh).max(axis=1) <= longest])


def split_long_edges(mesh: Mesh, longest: float) -> Mesh:
    """Halve the edges longer than `longest`, again and again; the surface itself stays.

    Parameters
    ----------
    mesh : what is manifold stays so: an edge is halved in all its triangles alike.
    longest : world units.
    """
    while True:
        shorter = halve_edges(mesh, longest)
        if len(shorter.vertices) == len(mesh.vertices):
            return mesh
        mesh = shorter


def halve_edges(mesh: Mesh, longest: float, border: bool = True) -> Mesh:
    """Halve the edges longer than `longest` once; the old vertices keep their numbers.

    Parameters
    ----------
    border : whether the mesh's border edges, too.
    """
    edges = edges_of(mesh.faces)
    a, b = mesh.vertices[edges.pairs[:, 0]], mesh.vertices[edges.pairs[:, 1]]
    split = np.linalg.norm(a - b, axis=1) > longest
    if not border:
        split &= edges.count > 1
    middle = np.full(len(split), -1, dtype=np.int64)
    middle[split] = len(mesh.vertices) + np.arange(int(split.sum()))
    vertices = np.concatenate([mesh.vertices, 0.5 * (a[split] + b[split])])
    return Mesh(vertices, halved(mesh.faces, middle[edges.of_face]))


def _lengths(mesh: Mesh) -> NDArray[np.float64]:
    """(F, 3) lengths of the edges from corner k to corner k + 1."""
    corners = mesh.vertices[mesh.faces]
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
