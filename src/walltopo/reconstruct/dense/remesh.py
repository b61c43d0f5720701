"""Clean a mesh: collapse short edges, drop fragments, close holes; the mesh stays manifold.

Marching cubes puts a vertex wherever the surface cuts a grid line, often two almost coincident. An
edge is collapsed only if the link condition holds (Dey et al., "Topology preserving edge
contraction", 1999), so the surface's topology never changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, StageError
from walltopo.geometry.graphs import duplicate_faces, symmetric_matrix
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import (
    boundary_loops,
    bounds_by_group,
    close_loops,
    compact_vertices,
    edge_lengths,
    edges_of,
    face_components,
    fans,
    split_fans,
)
from walltopo.reconstruct.dense.gaps import sew_gaps
from walltopo.reconstruct.settings import DenseSettings

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]

# Limits of a collapse: the minimum cosine between a face's old and new normal, and the minimum
# shape of a face (twice the area over the longest side squared; equilateral: 0.87).
_MIN_COSINE = 0.3
_MIN_SHAPE = 0.01
_PASSES = 4
# Edges shorter than this share of the target length are collapsed.
_SHORTEST_EDGE = 0.5


@kernel
def _shape(a: Floats, b: Floats, c: Floats, normal: Floats) -> float:
    """Return twice the area over the longest side squared; write the unnormalised normal."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    normal[0], normal[1], normal[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    longest = max(longest, wx * wx + wy * wy + wz * wz)
    size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    return size / longest if longest > 0 else 0.0


@kernel
def _square(v: Floats) -> float:
    """Return the squared length, in scalars because array expressions compile slowly."""
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


@kernel
def _accepts(
    vertices: Floats,
    faces: Faces,
    alive: NDArray[np.bool_],
    head: NDArray[np.int32],
    following: NDArray[np.int32],
    moved: int,
    other: int,
    place: Floats,
) -> bool:
    """Return whether vertex `moved` may go to `place` when it is merged with vertex `other`.

    No other face around `moved` may flip or become a new sliver.
    """
    before, after = np.empty(3), np.empty(3)
    corner = head[moved]
    while corner >= 0:
        face = corner // 3
        if alive[face]:
            k = corner - 3 * face
            second, third = faces[face, (k + 1) % 3], faces[face, (k + 2) % 3]
            if second != other and third != other:
                p, q = vertices[second], vertices[third]
                old = _shape(vertices[moved], p, q, before)
                new = _shape(place, p, q, after)
                if new < _MIN_SHAPE and new < old:
                    return False
                if old > _MIN_SHAPE:
                    dot = before[0] * after[0] + before[1] * after[1] + before[2] * after[2]
                    sizes = np.sqrt(_square(before) * _square(after))
                    if dot < _MIN_COSINE * sizes:
                        return False
        corner = following[corner]
    return True


@kernel
def _link_holds(
    faces: Faces,
    alive: NDArray[np.bool_],
    head: NDArray[np.int32],
    following: NDArray[np.int32],
    stamp: NDArray[np.int32],
    mark: int,
    u: int,
    v: int,
) -> bool:
    """Return whether the link condition holds: all common neighbours of u and v lie on their common
    faces."""
    shared = 0
    corner = head[u]
    while corner >= 0:
        face = corner // 3
        if alive[face]:
            k = corner - 3 * face
            second, third = faces[face, (k + 1) % 3], faces[face, (k + 2) % 3]
            stamp[second] = mark
            stamp[third] = mark
            if second == v or third == v:
                shared += 1
        corner = following[corner]
    common = 0
    corner = head[v]
    while corner >= 0:
        face = corner // 3
        if alive[face]:
            k = corner - 3 * face
            for step in (1, 2):
                near = faces[face, (k + step) % 3]
                if stamp[near] == mark and near != u:
                    stamp[near] = mark - 1
                    common += 1
        corner = following[corner]
    return shared in (1, 2) and common == shared


@kernel
def _collapse(
    vertices: Floats,
    faces: Faces,
    alive: NDArray[np.bool_],
    rim: NDArray[np.bool_],
    pairs: NDArray[np.int32],
    is_boundary: NDArray[np.bool_],
    longest: float,
) -> int:
    """Collapse the allowed edges in the given order, in place; return the number collapsed."""
    count = len(vertices)
    head, tail = np.full(count, -1, np.int32), np.full(count, -1, np.int32)
    following = np.full(3 * len(faces), -1, np.int32)
    for face in range(len(faces)):
        for k in range(3):
            v = faces[face, k]
            corner = 3 * face + k
            if head[v] < 0:
                head[v] = corner
            else:
                following[tail[v]] = corner
            tail[v] = corner
    difference, place = np.zeros(3), np.zeros(3)
    stamp = np.full(count, -1, np.int32)
    removed = np.zeros(count, np.bool_)
    collapsed = 0
    mark = 0
    for e in range(len(pairs)):
        u, v = pairs[e, 0], pairs[e, 1]
        if removed[u] or removed[v]:
            continue
        if rim[u] and rim[v] and not is_boundary[e]:
            continue
        for axis in range(3):
            a, b = vertices[u, axis], vertices[v, axis]
            difference[axis] = a - b
            place[axis] = 0.5 * (a + b) if rim[u] == rim[v] else (a if rim[u] else b)
        if _square(difference) > longest**2:
            continue
        mark += 2
        if not _link_holds(faces, alive, head, following, stamp, mark, u, v):
            continue
        if not _accepts(vertices, faces, alive, head, following, u, v, place):
            continue
        if not _accepts(vertices, faces, alive, head, following, v, u, place):
            continue
        corner = head[v]
        while corner >= 0:
            face = corner // 3
            if alive[face]:
                if faces[face, 0] == u or faces[face, 1] == u or faces[face, 2] == u:
                    alive[face] = False
                else:
                    faces[face, corner - 3 * face] = u
            corner = following[corner]
        following[tail[u]] = head[v]
        tail[u] = tail[v]
        for axis in range(3):
            vertices[u, axis] = place[axis]
        rim[u] = rim[u] or rim[v]
        removed[v] = True
        collapsed += 1
    return collapsed


def collapse_short_edges(mesh: Mesh, shortest: float, border: bool = True) -> Mesh:
    """Collapse edges shorter than `shortest`, the shortest first.

    Parameters
    ----------
    mesh : manifold.
    shortest : world units. An edge stays if its collapse would change the topology, flip a face
        or make a sliver.
    border : whether edges at boundary vertices are collapsed too.
    """
    for _ in range(_PASSES):
        edges = edges_of(mesh.faces)
        length = edge_lengths(mesh.vertices, edges)
        rim = np.zeros(len(mesh.vertices), dtype=np.bool_)
        rim[edges.pairs[edges.count == 1].ravel()] = True
        short = np.flatnonzero((length < shortest) & (border | ~rim[edges.pairs].any(axis=1)))
        if len(short) == 0:
            break
        short = short[np.argsort(length[short], kind="stable")]
        pairs, is_boundary = edges.pairs[short], edges.count[short] == 1
        del edges, length
        vertices, faces = mesh.vertices.copy(), mesh.faces.copy()
        alive = np.ones(len(faces), dtype=np.bool_)
        collapsed = _collapse(vertices, faces, alive, rim, pairs, is_boundary, shortest)
        mesh = Mesh(*compact_vertices(vertices, faces[alive]))
        if collapsed < 0.02 * len(short):
            break
    return mesh


def finish_surface(mesh: Mesh, settings: DenseSettings, edge: float, unit: float) -> Mesh:
    """Clean a raw surface: manifold, no fragments, small openings closed, even triangles.

    Parameters
    ----------
    mesh : raw mesh of a backend.
    settings : maximum sizes of fragments, gaps and holes.
    edge : target edge length, world units.
    unit : length of a settings metre, world units.

    Raises
    ------
    StageError : every component is a fragment.
    """
    mesh = drop_fragments(make_manifold(mesh), settings.min_part * unit)
    if len(mesh.faces) == 0:
        raise StageError(
            "the reconstructed surface consists of small fragments only", "Take more photos."
        )
    mesh = fill_holes(mesh, settings.max_hole * unit)
    mesh = collapse_short_edges(mesh, _SHORTEST_EDGE * edge)
    # Closing the thin parts of a wider gap leaves holes, which may be small enough to fill now.
    mesh = fill_holes(sew_gaps(mesh, settings.max_gap * unit), settings.max_hole * unit)
    return make_manifold(mesh)


def drop_fragments(mesh: Mesh, min_diameter: float) -> Mesh:
    """Remove connected components whose bounding box has a diagonal below `min_diameter`."""
    part = face_components(mesh.faces)
    count = int(part.max(initial=-1)) + 1
    low, high = bounds_by_group(part, (mesh.vertices[corner] for corner in mesh.faces.T), count)
    keep = np.linalg.norm(high - low, axis=1) >= min_diameter
    return Mesh(*compact_vertices(mesh.vertices, mesh.faces[keep[part]]))


def make_manifold(mesh: Mesh) -> Mesh:
    """Drop degenerate and duplicate faces and those at crowded edges; split non-manifold vertices.

    The result is edge- and vertex-manifold. Its winding is as consistent as that of the input.
    """
    faces = mesh.faces
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a) & ~duplicate_faces(faces)]
    while True:
        edges = edges_of(faces)
        if not (crowded := edges.count > 2).any():
            fan = fans(faces, edges)
            del edges
            return split_fans(Mesh(mesh.vertices, faces), fan)
        faces = _drop_at_crowded_edges(mesh.vertices, faces, edges.of_face, crowded)


def _drop_at_crowded_edges(
    vertices: Floats, faces: Faces, of_face: NDArray[np.int32], crowded: NDArray[np.bool_]
) -> Faces:
    """Remove the smallest face at every edge with more than two faces."""
    area = Mesh(vertices, faces).areas
    face, corner = np.nonzero(crowded[of_face])
    edge = of_face[face, corner]
    order = np.lexsort((area[face], edge))
    smallest = np.unique(edge[order], return_index=True)[1]
    drop = np.zeros(len(faces), dtype=np.bool_)
    drop[face[order][smallest]] = True
    return faces[~drop]


def fill_holes(mesh: Mesh, largest: float) -> Mesh:
    """Close boundary loops up to a diameter with a fan of triangles around their centroid.

    Parameters
    ----------
    mesh : manifold.
    largest : loops whose bounding box has a longer diagonal stay open, such as the mesh's outline.
    """
    loops = boundary_loops(mesh.faces)
    holes = [n for n in loops if np.linalg.norm(np.ptp(mesh.vertices[n], axis=0)) <= largest]
    return Mesh(*close_loops(mesh.vertices, mesh.faces, holes))


def smooth(mesh: Mesh, steps: int, inward: float = 0.5, outward: float = -0.53) -> Mesh:
    """Smooth a mesh by `steps` pairs of an inward and an outward step; the boundary stays fixed.

    Taubin, "A signal processing approach to fair surface design", 1995.
    """
    from scipy.sparse import diags

    edges = edges_of(mesh.faces)
    n = len(mesh.vertices)
    i, j = edges.pairs.T
    graph = symmetric_matrix(n, i, j, np.ones(len(i)))
    degree = np.asarray(graph.sum(axis=1)).ravel()
    mean = diags(1.0 / np.maximum(degree, 1.0)) @ graph
    free = (degree > 0)[:, None].copy()
    free[edges.pairs[edges.count == 1].ravel()] = False
    vertices = mesh.vertices
    for _ in range(steps):
        for rate in (inward, outward):
            vertices = vertices + rate * np.where(free, mean @ vertices - vertices, 0.0)
    return Mesh(vertices, mesh.faces)
