"""A manifold proxy of the wall, on which geodesic paths are solved.

Real meshes have edges with three triangles, flipped triangles, holes and floaters; the geodesic
solver needs an oriented manifold. The repair, in this order:

1. weld coincident vertices (STL-like meshes share none),
2. simplify by quadric edge collapse to `target` triangles (a hold-to-hold path does not
   need more; the length error is measured in docs/routes.md),
3. drop degenerate and duplicate triangles,
4. glue triangles only along edges where exactly two meet in opposite directions; where more
   meet, one such pair is glued; all other edges are cut open by duplicating the vertices,
5. drop floaters (`MIN_PART_SHARE`), so that no hold is anchored on one,
6. fill small holes (loops of up to `MAX_LOOP` edges) with a fan,
7. insert one vertex per hold, so that a path ends at the hold.

Other connected components stay separate; `geodesic.py` explains how paths cross between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, StageError
from walltopo.describe.routes.simplify_worker import simplified, simplified_in_subprocess
from walltopo.geometry.graphs import duplicate_faces
from walltopo.geometry.topology import (
    boundary_loops,
    close_loops,
    compact_vertices,
    glued_fans,
    opposite_half_edges,
    split_fans,
    vertex_components,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PROXY_FACES = 20_000  # triangles of a scan's proxy
SUBPROCESS_FACES = 250_000  # larger meshes are simplified in a subprocess, which frees its memory
MAX_LOOP = 60  # edges of the longest boundary loop that is filled
MIN_PART_SHARE = 2e-3  # share of the wall's area below which a component is a floater
MARGIN = 2e-3  # minimum barycentric distance of anchors from edges, against degenerate triangles


@dataclass(frozen=True, eq=False)
class Proxy:
    """An oriented manifold triangle mesh with one vertex per anchor.

    Parameters
    ----------
    vertices : (V, 3) float64, world frame.
    faces : (F, 3) int64.
    anchors : (A,) int64, the vertex of each anchor.
    part : (V,) int64, number of the connected component of each vertex.
    """

    vertices: Floats
    faces: Ints
    anchors: Ints
    part: Ints


def weld(vertices: Floats, faces: NDArray[np.integer]) -> tuple[Floats, Ints]:
    """Return the mesh with vertices within a millionth of the mesh's size of each other merged."""
    step = max(float(np.ptp(vertices, axis=0).max()), 1e-12) * 1e-6
    cells = np.round((vertices - vertices.min(axis=0)) / step).astype(np.int64)
    # One integer per cell: 21 bits per axis suffice for a million cells.
    key = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    return vertices[first], inverse[faces].astype(np.int64)


def simplify(vertices: Floats, faces: NDArray[np.integer], target: int) -> tuple[Floats, Ints]:
    """Return the mesh simplified to about `target` triangles (unchanged if it has fewer)."""
    if len(faces) <= target:
        return vertices.astype(np.float64), faces.astype(np.int64)
    # Centre the mesh, because the simplifier works in float32.
    centre = vertices.mean(axis=0)
    work = simplified_in_subprocess if len(faces) > SUBPROCESS_FACES else simplified
    points, triangles = work(
        np.ascontiguousarray(vertices - centre, dtype=np.float32),
        np.ascontiguousarray(faces, dtype=np.int32),
        target,
    )
    return np.asarray(points, np.float64) + centre, np.asarray(triangles, np.int64)


def _drop_degenerate(vertices: Floats, faces: Ints) -> Ints:
    """Return the faces without degenerate and duplicate ones."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    scale = np.ptp(vertices, axis=0).max() if len(vertices) else 1.0
    faces = faces[area > 1e-14 * scale * scale]
    return faces[~duplicate_faces(faces)]


def _cut_open(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Give each fan of glued triangles around a vertex its own vertex."""
    fan = glued_fans(faces, *opposite_half_edges(faces))
    cut = split_fans(Mesh(vertices, faces.astype(np.int32)), fan)
    return cut.vertices, cut.faces.astype(np.int64)


def _surplus_faces(faces: Ints) -> Ints:
    """Return the faces that still share an edge with two others after cutting."""
    start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    n = int(faces.max()) + 1
    key = start * n + end
    _, first = np.unique(key, return_index=True)
    repeated = np.ones(len(key), dtype=np.bool_)
    repeated[first] = False
    return np.flatnonzero(repeated) // 3


def manifold(vertices: Floats, faces: NDArray[np.integer]) -> tuple[Floats, Ints]:
    """Return a triangle soup cut open until it is an oriented manifold.

    A vertex is duplicated for each fan of glued triangles around it. A triangle is dropped only
    if its fan is connected elsewhere to the triangles from which it must be cut.

    Returns
    -------
    (V', 3) float64 vertices and (F', 3) int64 faces, every vertex used.
    """
    points = np.asarray(vertices, np.float64)
    kept = _drop_degenerate(points, faces.astype(np.int64))
    while len(kept):
        points, kept = _cut_open(points, kept)
        surplus = _surplus_faces(kept)
        if len(surplus):
            kept = np.delete(kept, surplus, axis=0)
            continue
        again, _ = _cut_open(points, kept)
        if len(again) == len(points):
            return points, kept
    return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)


def fill_small_holes(
    vertices: Floats, faces: Ints, max_loop: int = MAX_LOOP
) -> tuple[Floats, Ints]:
    """Return the mesh with boundary loops of at most `max_loop` edges closed.

    The longest loop stays open, because it is the outline of the wall.
    """
    loops = sorted(boundary_loops(faces), key=len)[:-1]
    points, closed = close_loops(vertices, faces, [n for n in loops if len(n) <= max_loop])
    return points, closed.astype(np.int64)


def _nearest_on_triangles(point: Floats, corners: Floats) -> tuple[int, Floats]:
    """Return the triangle nearest to a point, and barycentric coordinates of the foot point."""
    from trimesh.triangles import closest_point, points_to_barycentric

    feet = closest_point(corners, np.broadcast_to(point, (len(corners), 3)))
    winner = int(np.linalg.norm(feet - point, axis=1).argmin())
    return winner, points_to_barycentric(corners[[winner]], feet[[winner]])[0]


def _insert_anchors(vertices: Floats, faces: Ints, anchors: Floats) -> tuple[Floats, Ints, Ints]:
    """Split the triangle nearest to each anchor at the anchor's foot point."""
    from scipy.spatial import cKDTree

    points, triangles = list(vertices), list(faces)
    tree = cKDTree(vertices[faces].mean(axis=1))
    _, near = tree.query(anchors, k=min(32, len(faces)))
    near = np.asarray(near).reshape(len(anchors), -1)
    children: dict[int, list[int]] = {}
    result = np.zeros(len(anchors), dtype=np.int64)
    for number, anchor in enumerate(anchors):
        candidates = [c for f in near[number].tolist() for c in children.get(f, [f])]
        corners = np.array([[points[v] for v in triangles[c]] for c in candidates])
        winner, weights = _nearest_on_triangles(anchor, corners)
        chosen = candidates[winner]
        a, b, c = (int(v) for v in triangles[chosen])
        if weights.max() > 1 - MARGIN:
            result[number] = (a, b, c)[int(weights.argmax())]
            continue
        weights = np.maximum(weights, MARGIN)
        weights /= weights.sum()
        new = len(points)
        points.append(weights @ corners[winner])
        triangles[chosen] = np.array([a, b, new])
        triangles += [np.array([b, c, new]), np.array([c, a, new])]
        root = next((f for f, kids in children.items() if chosen in kids), chosen)
        children.setdefault(root, [root]).extend([len(triangles) - 2, len(triangles) - 1])
        result[number] = new
    return np.array(points), np.array(triangles, dtype=np.int64), result


def _without_floaters(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Drop components with less than `MIN_PART_SHARE` of the area."""
    if len(faces) == 0:
        return vertices, faces
    part = vertex_components(faces, len(vertices))[faces[:, 0]]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.bincount(part, np.linalg.norm(np.cross(b - a, c - a), axis=1))
    kept = faces[area[part] >= MIN_PART_SHARE * area.sum()]
    points, triangles = compact_vertices(vertices, kept)
    return points, triangles.astype(np.int64)


def build_proxy(
    vertices: Floats, faces: NDArray[np.integer], anchors: Floats, target: int
) -> Proxy:
    """Return the simplified, repaired mesh with anchors: see the module's docstring.

    Parameters
    ----------
    vertices : (V, 3) float64; faces : (F, 3) int, any triangle soup.
    anchors : (A, 3) float64, points near the surface (holds), same frame.
    target : number of triangles of the proxy.
    """
    points, triangles = _without_floaters(*manifold(*simplify(*weld(vertices, faces), target)))
    if len(triangles) == 0:
        raise StageError(
            "the mesh has no triangle with an area, so no path can be measured on it",
            "Inspect mesh.ply and run the dense stage again.",
        )
    points, triangles = fill_small_holes(points, triangles)
    points, triangles, rows = _insert_anchors(points, triangles, np.asarray(anchors, np.float64))
    part = vertex_components(triangles, len(points)).astype(np.int64)
    return Proxy(points, triangles, rows, part)
