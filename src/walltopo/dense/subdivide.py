"""Long edges are halved until none is left: for surfaces that other programs made too coarse."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.meshes.halving import halved
from walltopo.meshes.topology import edges_of

__all__ = ["drop_wide", "split_long_edges"]


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
        edges = edges_of(mesh.faces)
        a, b = mesh.vertices[edges.pairs[:, 0]], mesh.vertices[edges.pairs[:, 1]]
        split = np.linalg.norm(a - b, axis=1) > longest
        if not split.any():
            return mesh
        middle = np.full(len(split), -1, dtype=np.int64)
        middle[split] = len(mesh.vertices) + np.arange(int(split.sum()))
        vertices = np.concatenate([mesh.vertices, 0.5 * (a[split] + b[split])])
        mesh = Mesh(vertices, halved(mesh.faces, middle[edges.of_face]))


def _lengths(mesh: Mesh) -> NDArray[np.float64]:
    """(F, 3) lengths of the edges from corner k to corner k + 1."""
    corners = mesh.vertices[mesh.faces]
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
