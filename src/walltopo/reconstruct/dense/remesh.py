"""Even triangles: short edges are collapsed, flat slivers flipped, and the mesh stays manifold.

Marching cubes leaves a vertex wherever the surface cuts a grid line, often two within a hair. A
collapse is made only where the link condition holds (Dey et al., "Topology preserving edge
contraction", 1999), so the surface's topology never changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, StageError
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import compact, edges_of
from walltopo.reconstruct.dense.clean import drop_crumbs, fill_holes, make_manifold
from walltopo.reconstruct.dense.gaps import sew_gaps
from walltopo.reconstruct.dense.settings import DenseSettings

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]

# A collapse may turn no face by more than this (cosine), nor leave one flatter than this
# (twice the area over the longest side squared; an equilateral triangle has 0.87).
_LEAST_COSINE = 0.3
_LEAST_SHAPE = 0.01
_PASSES = 4
# Edges shorter than this share of the length wanted are collapsed.
_SHORTEST_EDGE = 0.5


@kernel
def _shape(a: Floats, b: Floats, c: Floats, normal: Floats) -> float:
    """Twice the area over the longest side squared; writes the unnormalised normal."""
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
    """The squared length; spelled out, as above, because array expressions compile slowly."""
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


@kernel
def _accepts(
    vertices: Floats,
    faces: Faces,
    alive: NDArray[np.bool_],
    head: NDArray[np.int64],
    following: NDArray[np.int64],
    moved: int,
    other: int,
    place: Floats,
) -> bool:
    """Whether `moved` may go to `place`: no face around it but those it shares with `other`
    turns over or becomes a sliver that was none."""
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
                if new < _LEAST_SHAPE and new < old:
                    return False
                if old > _LEAST_SHAPE:
                    dot = before[0] * after[0] + before[1] * after[1] + before[2] * after[2]
                    sizes = np.sqrt(_square(before) * _square(after))
                    if dot < _LEAST_COSINE * sizes:
                        return False
        corner = following[corner]
    return True


@kernel
def _link_holds(
    faces: Faces,
    alive: NDArray[np.bool_],
    head: NDArray[np.int64],
    following: NDArray[np.int64],
    stamp: NDArray[np.int64],
    mark: int,
    u: int,
    v: int,
) -> bool:
    """Whether u and v have just the common neighbours that their common faces give them."""
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
    pairs: NDArray[np.int64],
    on_rim: NDArray[np.bool_],
    longest: float,
) -> int:
    """Collapse the edges in their order where that is allowed (in place); how many were."""
    count = len(vertices)
    head, tail = np.full(count, -1, np.int64), np.full(count, -1, np.int64)
    following = np.full(3 * len(faces), -1, np.int64)
    for face in range(len(faces)):
        for k in range(3):
            v = faces[face, k]
            corner = 3 * face + k
            if head[v] < 0:
                head[v] = corner
            else:
                following[tail[v]] = corner
            tail[v] = corner
    way, place = np.zeros(3), np.zeros(3)
    stamp = np.full(count, -1, np.int64)
    gone = np.zeros(count, np.bool_)
    done = 0
    mark = 0
    for e in range(len(pairs)):
        u, v = pairs[e, 0], pairs[e, 1]
        if gone[u] or gone[v]:
            continue
        if rim[u] and rim[v] and not on_rim[e]:
            continue
        for axis in range(3):
            a, b = vertices[u, axis], vertices[v, axis]
            way[axis] = a - b
            place[axis] = 0.5 * (a + b) if rim[u] == rim[v] else (a if rim[u] else b)
        if _square(way) > longest**2:
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
        gone[v] = True
        done += 1
    return done


def collapse_short_edges(mesh: Mesh, shortest: float, border: bool = True) -> Mesh:
    """Merge the ends of edges shorter than `shortest`, the shortest first.

    Parameters
    ----------
    mesh : manifold.
    shortest : world units. Edges stay where a collapse would change the topology, turn a face
        over or make a sliver.
    border : whether those at border vertices, too.
    """
    for _ in range(_PASSES):
        edges = edges_of(mesh.faces)
        ends = mesh.vertices[edges.pairs]
        length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
        rim = np.zeros(len(mesh.vertices), dtype=np.bool_)
        rim[edges.pairs[edges.count == 1].ravel()] = True
        short = np.flatnonzero((length < shortest) & (border | ~rim[edges.pairs].any(axis=1)))
        if len(short) == 0:
            break
        short = short[np.argsort(length[short], kind="stable")]
        vertices, faces = mesh.vertices.copy(), mesh.faces.copy()
        alive = np.ones(len(faces), dtype=np.bool_)
        done = _collapse(
            vertices, faces, alive, rim, edges.pairs[short], edges.count[short] == 1, shortest
        )
        mesh = Mesh(*compact(vertices, faces[alive]))
        if done < 0.02 * len(short):
            break
    return mesh


def finish(mesh: Mesh, settings: DenseSettings, edge: float, unit: float) -> Mesh:
    """Clean a raw surface: manifold, no crumbs, thin gaps and small holes closed, even triangles.

    Parameters
    ----------
    mesh : as a backend made it.
    settings : its sizes of crumbs, gaps and holes.
    edge : edge length wanted, world units.
    unit : world units that `settings` calls a metre.

    Raises
    ------
    StageError : nothing but crumbs.
    """
    mesh = drop_crumbs(make_manifold(mesh), settings.min_part * unit)
    if len(mesh.faces) == 0:
        raise StageError("the surface found consists of crumbs only", "Take more photos.")
    mesh = fill_holes(mesh, settings.max_hole * unit)
    mesh = collapse_short_edges(mesh, _SHORTEST_EDGE * edge)
    # A gap that is thin in places only leaves holes, which may be small enough now.
    mesh = fill_holes(sew_gaps(mesh, settings.max_gap * unit), settings.max_hole * unit)
    return make_manifold(mesh)
