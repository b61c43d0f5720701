"""Fill a rim with a membrane: a triangulation, refined and smoothed like a soap film."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.graphs import symmetric_matrix
from walltopo.geometry.kernels import kernel
from walltopo.geometry.subdivision import halve_edges
from walltopo.geometry.topology import edges_of, face_neighbours
from walltopo.reconstruct.dense.remesh import collapse_short_edges

Floats = NDArray[np.float64]

Faces = NDArray[np.int32]

# Edges longer than this many target lengths are halved.
_LONGEST = 1.4

# At the end, inner edges shorter than this many target lengths are collapsed.
_SHORTEST = 0.4

# Safety limit on rounds of halving and flipping; each round halves the longest edge.
_MAX_ROUNDS = 24

# An edge is flipped if the two angles opposite to it sum to more than pi (cosines below -_SLACK)
# and the cosine between the normals of the two new faces is at least _MIN_COSINE.
_SLACK = 1e-6

_MIN_COSINE = 0.5


def membrane(
    points: Floats, outer: Floats, barred: NDArray[np.bool_], edge: float
) -> tuple[Floats, Faces] | None:
    """Return the vertices and faces of a membrane that spans a rim, or None.

    Parameters
    ----------
    points, outer, barred : see `triangulate_rim`.
    edge : target edge length, world units.

    Returns
    -------
    (m, 3) new vertices, and (f, 3) faces wound as the mesh. Face indices below n are rim vertices;
    n + k is new vertex k. No edge joins two rim vertices of a `barred` pair. None if the rim
    cannot be spanned.
    """
    found = triangulate_rim(points, outer, barred)
    if found is None:
        return None
    n = len(points)
    vertices, faces = points, found.astype(np.int32)
    for _ in range(_MAX_ROUNDS):
        faces = _flip_edges(vertices, faces, barred)
        mesh = halve_edges(Mesh(vertices, faces), _LONGEST * edge, border=False)
        if len(mesh.vertices) == len(vertices):
            break
        vertices, faces = _relax_vertices(mesh.vertices, mesh.faces, n), mesh.faces
    # If the rim touches itself, relaxed vertices may coincide.
    even = collapse_short_edges(Mesh(vertices, faces), _SHORTEST * edge, border=False)
    return even.vertices[n:], even.faces


def _relax_vertices(vertices: Floats, faces: Faces, fixed: int) -> Floats:
    """Move all vertices but the first `fixed` to the mean of their neighbours."""
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    i, j = edges_of(faces).pairs.T
    count = len(vertices)
    graph = symmetric_matrix(count, i, j, np.ones(len(i)))
    degree = np.asarray(graph.sum(axis=1)).ravel()
    free = graph[fixed:]
    system = (diags(degree[fixed:]) - free[:, fixed:]).tocsc()
    place = splu(system).solve(free[:, :fixed] @ vertices[:fixed])
    return np.concatenate([vertices[:fixed], place])


def _flip_edges(vertices: Floats, faces: Faces, barred: NDArray[np.bool_]) -> Faces:
    """Return the faces after flips of inner edges towards a Delaunay triangulation."""
    result = faces.copy()
    a, b = np.nonzero(barred)
    count = len(vertices)
    edges = edges_of(faces).pairs.astype(np.int64)
    keys = np.concatenate([a * count + b, edges[:, 0] * count + edges[:, 1]])
    _flip(vertices, result, face_neighbours(faces), keys)
    return result


@kernel
def _cosine_at(p: Floats, q: Floats, r: Floats) -> float:
    """Return the cosine at p between q and r, in scalars: array expressions compile slowly."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    squares = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)
    return (ux * vx + uy * vy + uz * vz) / np.sqrt(max(squares, 1e-60))


@kernel
def _normal(p: Floats, q: Floats, r: Floats) -> tuple[float, float, float]:
    """Return the normal of a triangle; its length is twice the triangle's area."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@kernel
def _flip(vertices: Floats, faces: Faces, across: Faces, keys: NDArray[np.int64]) -> None:
    """Flip edges in place until no flip improves the triangulation.

    Parameters
    ----------
    across : (F, 3) as returned by `face_neighbours`; updated in place.
    keys : a * V + b for vertices a < b that no new edge may join, which includes all edges.
    """
    count = len(vertices)
    joined = set(keys)
    queue = list(range(3 * len(faces)))
    max_steps = 40 * len(queue)
    at = 0
    while at < len(queue) and at < max_steps:
        f, k = queue[at] // 3, queue[at] % 3
        at += 1
        g = across[f, k]
        if g < 0:
            continue
        a, b, c = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
        m = 0
        while faces[g, m] != b or faces[g, (m + 1) % 3] != a:
            m += 1
        d = faces[g, (m + 2) % 3]
        pa, pb, pc, pd = vertices[a], vertices[b], vertices[c], vertices[d]
        # The angles sum to more than pi if the sum of their cosines is negative.
        if _cosine_at(pc, pa, pb) + _cosine_at(pd, pa, pb) >= -_SLACK:
            continue
        key = min(c, d) * count + max(c, d)
        if key in joined:
            continue
        x, y, z = _normal(pc, pd, pb)
        i, j, h = _normal(pc, pa, pd)
        sizes = np.sqrt((x * x + y * y + z * z) * (i * i + j * j + h * h))
        if x * i + y * j + z * h < _MIN_COSINE * sizes or sizes <= 0.0:
            continue
        joined.remove(min(a, b) * count + max(a, b))
        joined.add(key)
        # (a, b, c) and (b, a, d) become (c, d, b) and (d, c, a).
        bc, ca = across[f, (k + 1) % 3], across[f, (k + 2) % 3]
        ad, db = across[g, (m + 1) % 3], across[g, (m + 2) % 3]
        faces[f, 0], faces[f, 1], faces[f, 2] = c, d, b
        faces[g, 0], faces[g, 1], faces[g, 2] = d, c, a
        across[f, 0], across[f, 1], across[f, 2] = g, db, bc
        across[g, 0], across[g, 1], across[g, 2] = f, ca, ad
        _relink(across, db, g, f)
        _relink(across, ca, f, g)
        for s in (1, 2):
            queue.append(3 * f + s)
            queue.append(3 * g + s)


@kernel
def _relink(across: Faces, face: int, old: int, new: int) -> None:
    """Replace one neighbour of a face by another."""
    if face >= 0:
        for k in range(3):
            if across[face, k] == old:
                across[face, k] = new
                return


Ints = NDArray[np.int64]

# Folds (1 - cosine of the dihedral angle) are rounded to this step; among equal folds the smaller
# area wins.
_FOLD_STEP = 0.1

# A fold above this means that a triangle lies back on its neighbour.
_FOLDED = 1.98


@kernel
def _best_third_vertices(points: Floats, outer: Floats, barred: NDArray[np.bool_]) -> Ints:
    """Return the third vertex over each chord i < j, (n, n); -1 = impossible.

    Parameters
    ----------
    points : (n, 3), the rim in the direction of the mesh's boundary edges.
    outer : (n, 3) unit normal of the mesh's face at edge k, k + 1.
    barred : (n, n) chords that the mesh already has as edges.
    """
    n = len(points)
    third = np.full((n, n), -1, dtype=np.int64)
    # Symmetric tables, so that both access patterns read contiguous memory.
    fold = np.zeros((n, n), dtype=np.float32)
    area = np.zeros((n, n), dtype=np.float32)
    normal = np.zeros((n, n, 3), dtype=np.float32)
    for i in range(n - 1):
        for axis in range(3):
            normal[i, i + 1, axis] = normal[i + 1, i, axis] = outer[i, axis]
    for span in range(2, n):
        for i in range(n - span):
            j = i + span
            last = span == n - 1
            best_fold, best_area, best = np.float32(9.0), np.float32(np.inf), -1
            bx, by, bz = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            ux, uy, uz = (
                points[j, 0] - points[i, 0],
                points[j, 1] - points[i, 1],
                points[j, 2] - points[i, 2],
            )
            if last or not barred[i, j]:
                for k in range(i + 1, j):
                    worst = max(fold[i, k], fold[j, k])
                    if worst > best_fold:
                        continue
                    vx, vy, vz = (
                        points[k, 0] - points[i, 0],
                        points[k, 1] - points[i, 1],
                        points[k, 2] - points[i, 2],
                    )
                    # normal of the face (j, k, i)
                    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                    size = np.sqrt(nx * nx + ny * ny + nz * nz)
                    if size <= 1e-30:
                        continue
                    nx, ny, nz = nx / size, ny / size, nz / size
                    a = 1.0 - (nx * normal[i, k, 0] + ny * normal[i, k, 1] + nz * normal[i, k, 2])
                    b = 1.0 - (nx * normal[j, k, 0] + ny * normal[j, k, 1] + nz * normal[j, k, 2])
                    turn = max(a, b)
                    if last:
                        turn = max(
                            turn,
                            1.0
                            - (nx * outer[n - 1, 0] + ny * outer[n - 1, 1] + nz * outer[n - 1, 2]),
                        )
                    if turn > _FOLDED:
                        continue
                    worst = max(worst, np.float32(np.floor(turn / _FOLD_STEP) * _FOLD_STEP))
                    total = area[i, k] + area[j, k] + np.float32(0.5 * size)
                    if worst < best_fold or (worst == best_fold and total < best_area):
                        best_fold, best_area, best = worst, total, k
                        bx, by, bz = np.float32(nx), np.float32(ny), np.float32(nz)
            third[i, j] = best
            fold[i, j], fold[j, i] = best_fold, best_fold
            area[i, j], area[j, i] = best_area, best_area
            normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = bx, by, bz
            normal[j, i, 0], normal[j, i, 1], normal[j, i, 2] = bx, by, bz
    return third


def triangulate_rim(
    points: Floats, outer: Floats, barred: NDArray[np.bool_]
) -> NDArray[np.int64] | None:
    """Triangulate a rim without new vertices.

    Parameters
    ----------
    points : (n, 3) float, the rim in the direction of the mesh's boundary edges.
    outer : (n, 3) unit normal of the mesh's face at the edge from vertex k to the next.
    barred : (n, n) bool, pairs of rim vertices that no new edge may join.

    Returns
    -------
    (n - 2, 3) indices into the rim, wound as the mesh; None if every triangulation is barred.
    """
    third = _best_third_vertices(points, outer, barred)
    faces, chords = [], [(0, len(points) - 1)]
    while chords:
        i, j = chords.pop()
        if j - i < 2:
            continue
        k = int(third[i, j])
        if k < 0:
            return None
        faces.append((j, k, i))
        chords += [(i, k), (k, j)]
    return np.array(faces, dtype=np.int64)
