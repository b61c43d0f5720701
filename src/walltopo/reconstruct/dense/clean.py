"""From the raw surface to a mesh that later stages can trust: manifold, whole, even, no crumbs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.reconstruct.dense.topology import boundary_loops, compact, edges_of, fans, parts

__all__ = ["decimate", "drop_crumbs", "fill_holes", "make_manifold", "smooth"]

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
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    unique = np.zeros(len(faces), dtype=np.bool_)
    unique[first] = True
    faces = faces[(a != b) & (b != c) & (c != a) & unique]
    while True:
        edges = edges_of(faces)
        if not (crowded := edges.count > 2).any():
            break
        # The largest two faces of a crowded edge stay.
        faces = _thin_out(mesh.vertices, faces, edges.of_face, crowded)
    fan = fans(faces)
    # A fan is a vertex of its own: vertices where two fans touch come apart.
    slots = np.unique(fan, return_index=True)[1]
    return Mesh(mesh.vertices[faces.ravel()[slots]], fan.astype(np.int32))


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
    vertices, faces = [mesh.vertices], [mesh.faces]
    count = len(mesh.vertices)
    for loop in boundary_loops(mesh.faces):
        points = mesh.vertices[loop]
        if float(np.linalg.norm(np.ptp(points, axis=0))) > largest:
            continue
        following = np.roll(loop, -1)
        if len(loop) == 3:
            faces.append(loop[None, ::-1].astype(np.int32))
            continue
        vertices.append(points.mean(axis=0, keepdims=True))
        fan = np.stack([following, loop, np.full(len(loop), count)], axis=1)
        faces.append(fan.astype(np.int32))
        count += 1
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


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


def decimate(mesh: Mesh, edge_length: float) -> Mesh:
    """Fewer faces, so that an even mesh of as many would have edges of `edge_length`.

    Quadric error collapse (Garland and Heckbert, 1997): flat parts get larger triangles.
    """
    import fast_simplification

    target = float(mesh.areas.sum()) / (np.sqrt(3.0) / 4.0 * edge_length**2)
    if target >= len(mesh.faces):
        return mesh
    vertices, faces = fast_simplification.simplify(
        mesh.vertices.astype(np.float32),
        mesh.faces,
        target_count=max(4, int(target)),
        agg=3,
    )
    return make_manifold(Mesh(vertices, faces))
