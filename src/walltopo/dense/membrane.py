"""A membrane over a rim: even triangles, smooth as a soap film, the rim as it is.

After Liepa, "Filling holes in meshes", 2003: triangulate the rim, refine the triangles to the
edge length around it, flip edges towards Delaunay, and let the new vertices go where they rest.
They rest in the mean of their neighbours (the paper's fairing is of second order): so none leaves
the hull of the rim, however rough it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.dense.remesh import collapse_short_edges
from walltopo.dense.rim import triangulate_rim
from walltopo.dense.subdivide import halve_edges
from walltopo.kernels import kernel
from walltopo.meshes.neighbours import face_neighbours
from walltopo.meshes.topology import edges_of

__all__ = ["membrane"]

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]

# Edges longer than this many of the length wanted are halved.
_LONGEST = 1.4
# and in the end inner edges shorter than this are collapsed.
_SHORTEST = 0.4
# Rounds of halving and flipping; each halves the longest edge, so this is never reached.
_MOST_ROUNDS = 24
# An edge is flipped where the angles against it exceed two right ones by this much (as cosines),
# and the two faces over the new one turn by less than this (cosine) from each other.
_SLACK = 1e-6
_LEAST_COSINE = 0.5


def membrane(
    points: Floats, outer: Floats, barred: NDArray[np.bool_], edge: float
) -> tuple[Floats, Faces] | None:
    """Vertices and faces that span a rim.

    Parameters
    ----------
    points, outer, barred : see `triangulate_rim`.
    edge : edge length wanted, world units.

    Returns
    -------
    (m, 3) new vertices, and (f, 3) faces wound as the mesh, whose indices below n are the rim's
    and n + k new vertex k; no edge joins two rim vertices that `barred` names. None where the rim
    cannot be spanned.
    """
    found = triangulate_rim(points, outer, barred)
    if found is None:
        return None
    n = len(points)
    vertices, faces = points, found.astype(np.int32)
    for _ in range(_MOST_ROUNDS):
        faces = _flipped(vertices, faces, barred)
        mesh = halve_edges(Mesh(vertices, faces), _LONGEST * edge, border=False)
        if len(mesh.vertices) == len(vertices):
            break
        vertices, faces = _at_rest(mesh.vertices, mesh.faces, n), mesh.faces
    # Where the rim touches itself, vertices come to rest in one place.
    even = collapse_short_edges(Mesh(vertices, faces), _SHORTEST * edge, border=False)
    return even.vertices[n:], even.faces


def _at_rest(vertices: Floats, faces: Faces, fixed: int) -> Floats:
    """The vertices with all but the first `fixed` in the mean of their neighbours."""
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import splu

    i, j = edges_of(faces).pairs.T
    count = len(vertices)
    graph = coo_matrix((np.ones(len(i)), (i, j)), shape=(count, count)).tocsr()
    graph = graph + graph.T
    degree = np.asarray(graph.sum(axis=1)).ravel()
    free = graph[fixed:]
    system = (diags(degree[fixed:]) - free[:, fixed:]).tocsc()
    place = splu(system).solve(free[:, :fixed] @ vertices[:fixed])
    return np.concatenate([vertices[:fixed], place])


def _flipped(vertices: Floats, faces: Faces, barred: NDArray[np.bool_]) -> Faces:
    """The faces after flips of inner edges towards Delaunay."""
    result = faces.copy()
    a, b = np.nonzero(barred)
    count = len(vertices)
    edges = edges_of(faces).pairs
    keys = np.concatenate([a * count + b, edges[:, 0] * count + edges[:, 1]]).astype(np.int64)
    _flip(vertices, result, face_neighbours(faces), keys)
    return result


@kernel
def _cosine_at(p: Floats, q: Floats, r: Floats) -> float:
    """Of the angle at p between q and r. (Spelled out: array expressions compile slowly.)"""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    squares = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)
    return (ux * vx + uy * vy + uz * vz) / np.sqrt(max(squares, 1e-60))


@kernel
def _normal(p: Floats, q: Floats, r: Floats) -> tuple[float, float, float]:
    """Of the triangle, twice its area long."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@kernel
def _flip(vertices: Floats, faces: Faces, across: Faces, keys: NDArray[np.int64]) -> None:
    """Flip edges until none is worth it (in place).

    Parameters
    ----------
    across : (F, 3) as of `face_neighbours`; kept up.
    keys : a * V + b of vertices a < b that no new edge may join: all edges there are.
    """
    count = len(vertices)
    joined = set(keys)
    queue = list(range(3 * len(faces)))
    most = 40 * len(queue)
    at = 0
    while at < len(queue) and at < most:
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
        # Angles over pi together: the sum of their cosines is negative.
        if _cosine_at(pc, pa, pb) + _cosine_at(pd, pa, pb) >= -_SLACK:
            continue
        key = min(c, d) * count + max(c, d)
        if key in joined:
            continue
        x, y, z = _normal(pc, pd, pb)
        i, j, h = _normal(pc, pa, pd)
        sizes = np.sqrt((x * x + y * y + z * z) * (i * i + j * j + h * h))
        if x * i + y * j + z * h < _LEAST_COSINE * sizes or sizes <= 0.0:
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
    """One neighbour of a face instead of another."""
    if face >= 0:
        for k in range(3):
            if across[face, k] == old:
                across[face, k] = new
                return
