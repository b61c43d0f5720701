"""From the raw surface to a mesh that later stages can trust: manifold, whole, even, no crumbs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.borders import boundary_loops, close_loops
from walltopo.geometry.neighbours import parts
from walltopo.geometry.topology import compact, doubled, edges_of, split_fans

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]


def drop_crumbs(mesh: Mesh, least_diameter: float) -> Mesh:
    """Remove loose parts whose bounding box has a diagonal below `least_diameter`."""
    part = parts(mesh.faces)
    count = int(part.max(initial=-1)) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for corner in range(3):
        points = mesh.vertices[mesh.faces[:, corner]]
        np.minimum.at(low, part, points)
        np.maximum.at(high, part, points)
    keep = np.linalg.norm(high - low, axis=1) >= least_diameter
    return Mesh(*compact(mesh.vertices, mesh.faces[keep[part]]))


def make_manifold(mesh: Mesh) -> Mesh:
    """Drop degenerate and doubled faces, then faces at edges of more than two, split vertices.

    The result is edge- and vertex-manifold and consistently wound where the input was.
    """
    faces = mesh.faces
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a) & ~doubled(faces)]
    while True:
        edges = edges_of(faces)
        if not (crowded := edges.count > 2).any():
            return split_fans(Mesh(mesh.vertices, faces))
        faces = _thin_out(mesh.vertices, faces, edges.of_face, crowded)


def _thin_out(
    vertices: Floats, faces: Faces, of_face: NDArray[np.int64], crowded: NDArray[np.bool_]
) -> Faces:
    """Without the smallest face at every edge that has more than two."""
    area = Mesh(vertices, faces).areas
    face, corner = np.nonzero(crowded[of_face])
    edge = of_face[face, corner]
    order = np.lexsort((area[face], edge))
    smallest = np.unique(edge[order], return_index=True)[1]
    drop = np.zeros(len(faces), dtype=np.bool_)
    drop[face[order][smallest]] = True
    return faces[~drop]


def fill_holes(mesh: Mesh, largest: float) -> Mesh:
    """Close border loops up to a diameter with a fan around their centre.

    Parameters
    ----------
    mesh : manifold.
    largest : loops whose bounding box has a longer diagonal stay open (the mesh's own rim).
    """
    loops = boundary_loops(mesh.faces)
    holes = [n for n in loops if np.linalg.norm(np.ptp(mesh.vertices[n], axis=0)) <= largest]
    return Mesh(*close_loops(mesh.vertices, mesh.faces, holes))


def smooth(mesh: Mesh, steps: int, inward: float = 0.5, outward: float = -0.53) -> Mesh:
    """Taubin's smoothing: `steps` pairs of a step inward and one outward; the rim stays.

    Taubin, "A signal processing approach to fair surface design", 1995.
    """
    from scipy.sparse import coo_matrix, diags

    edges = edges_of(mesh.faces)
    n = len(mesh.vertices)
    i, j = edges.pairs.T
    graph = coo_matrix((np.ones(len(i)), (i, j)), shape=(n, n)).tocsr()
    graph = graph + graph.T
    degree = np.asarray(graph.sum(axis=1)).ravel()
    mean = diags(1.0 / np.maximum(degree, 1.0)) @ graph
    free = (degree > 0)[:, None].copy()
    free[edges.pairs[edges.count == 1].ravel()] = False
    vertices = mesh.vertices
    for _ in range(steps):
        for rate in (inward, outward):
            vertices = vertices + rate * np.where(free, mean @ vertices - vertices, 0.0)
    return Mesh(vertices, mesh.faces)
