"""Close thin gaps in a mesh, whatever their length, without new vertices.

After Bernardini et al., "The ball-pivoting algorithm for surface reconstruction", 1999: a ball that
rolls over the mesh and does not fall through rests on three boundary vertices, which become a
triangle. The ball falls through every gap wider than its diameter, so wider gaps stay open.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import edges_of, fans

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Number of nearest boundary vertices tried as the third corner of an edge's triangle.
_MAX_CANDIDATES = 24
# Minimum cosine between the normals of a new face and the faces at both sides of the gap.
_MIN_COSINE = 0.3
# Maximum number of boundary edges that lead to a vertex, and from it.
_MAX_AT_VERTEX = 4
# Directions that differ by less than this angle (radians) count as equal. Other vertices may
# reach into a new face's circumcircle by this share of its radius.
_EPSILON = 1e-6


@kernel
def _leads_into_gap(
    vertices: Floats, ins: Ints, outs: Ints, normal: Floats, here: int, there: int
) -> bool:
    """Return whether the direction from a boundary vertex to another starts in a gap.

    Faces lie to the left of their boundary edges. Turning left from a direction in the gap, the
    first boundary edge leads away from the vertex; turning right, it leads to the vertex.

    Parameters
    ----------
    ins, outs : (V, _MAX_AT_VERTEX) other ends of the boundary edges to and from each vertex; -1 =
        none.
    normal : (3,) of the surface at `here`.
    """
    hx, hy, hz = vertices[here, 0], vertices[here, 1], vertices[here, 2]
    wx, wy, wz = vertices[there, 0] - hx, vertices[there, 1] - hy, vertices[there, 2] - hz
    nx, ny, nz = normal[0], normal[1], normal[2]
    lx, ly, lz = ny * wz - nz * wy, nz * wx - nx * wz, nx * wy - ny * wx  # to the left
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    first_out, first_in = 2.0 * np.pi, 2.0 * np.pi
    for leads_out in (True, False):
        for other in (outs if leads_out else ins)[here]:
            if other < 0:
                continue
            ex, ey, ez = vertices[other, 0] - hx, vertices[other, 1] - hy, vertices[other, 2] - hz
            # arctan2 needs both arguments scaled alike, hence `length`; the angle is in 0 .. 2 pi.
            along = ex * wx + ey * wy + ez * wz
            angle = np.arctan2(ex * lx + ey * ly + ez * lz, along * length)
            angle = angle % (2.0 * np.pi)
            is_same = other == there or min(angle, 2.0 * np.pi - angle) < _EPSILON
            if leads_out:
                first_out = min(first_out, 0.0 if is_same else angle)
            elif not is_same:
                first_in = min(first_in, angle)
    return first_out < first_in


@dataclass
class _Boundary:
    """The boundary of a mesh while its gaps are closed.

    Parameters
    ----------
    vertices : (V, 3), of the mesh.
    front : maps a boundary edge (start, stop), in its face's direction, to that face's unit normal.
    existing : every edge between boundary vertices, smaller vertex first.
    ins, outs : (V, _MAX_AT_VERTEX) other ends of the boundary edges to and from each vertex.
    normals : (V, 3) unit mean of the normals at a vertex's boundary edges.
    faces : new triangles.
    """

    vertices: Floats
    front: dict[tuple[int, int], Floats]
    existing: set[tuple[int, int]]
    ins: Ints
    outs: Ints
    normals: Floats
    faces: list[tuple[int, int, int]] = field(default_factory=list)

    def fits(self, edge: tuple[int, int], third: int) -> bool:
        """Return whether a triangle fits into a gap and leaves at most two faces at every edge."""
        if edge not in self.front or self.outs[third].max() < 0:
            return False
        for side in ((third, edge[0]), (edge[1], third)):
            if side in self.front:
                continue
            if _ordered(side) in self.existing or not (
                self._has_room(side) and self._is_open(side)
            ):
                return False
        return self._is_open((third, edge[0])) and self._is_open((edge[1], third))

    def _is_open(self, side: tuple[int, int]) -> bool:
        return all(
            _leads_into_gap(self.vertices, self.ins, self.outs, self.normals[a], a, b)
            for a, b in (side, side[::-1])
        )

    def _has_room(self, side: tuple[int, int]) -> bool:
        return bool((self.ins[side[0]] < 0).any() and (self.outs[side[1]] < 0).any())

    def _replace(self, table: Ints, vertex: int, old: int, new: int) -> None:
        table[vertex, int((table[vertex] == old).argmax())] = new

    def _remove(self, edge: tuple[int, int]) -> None:
        del self.front[edge]
        self._replace(self.outs, edge[0], edge[1], -1)
        self._replace(self.ins, edge[1], edge[0], -1)

    def add_face(self, edge: tuple[int, int], third: int, normal: Floats) -> list[tuple[int, int]]:
        """Add a triangle that fits; return the boundary edges that it creates."""
        self._remove(edge)
        created = []
        for side in ((third, edge[0]), (edge[1], third)):
            if side in self.front:
                self._remove(side)
            else:
                new = side[::-1]
                self.front[new] = normal
                self._replace(self.outs, new[0], -1, new[1])
                self._replace(self.ins, new[1], -1, new[0])
                self.existing.add(_ordered(new))
                created.append(new)
        self.faces.append((edge[1], edge[0], third))
        return created


def _ordered(edge: tuple[int, int]) -> tuple[int, int]:
    return edge if edge[0] < edge[1] else edge[::-1]


def _unit(vectors: Floats) -> Floats:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray((a * b).sum(axis=-1))


def _find_boundary(mesh: Mesh) -> _Boundary:
    """Return the boundary of a mesh."""
    edges = edges_of(mesh.faces)
    face, corner = np.nonzero((edges.count == 1)[edges.of_face])
    start, stop = mesh.faces[face, corner], mesh.faces[face, (corner + 1) % 3]
    a, b, c = (mesh.vertices[mesh.faces[face, k]] for k in range(3))
    normal = _unit(np.cross(b - a, c - a))
    front = dict(zip(zip(start.tolist(), stop.tolist(), strict=True), normal, strict=True))
    count = len(mesh.vertices)
    at_boundary, around = np.zeros(count, dtype=np.bool_), np.zeros((count, 3))
    at_boundary[start] = True
    np.add.at(around, start, normal)
    np.add.at(around, stop, normal)
    inner = at_boundary[edges.pairs].all(axis=1)
    existing = set(map(tuple, edges.pairs[inner].tolist()))
    ins, outs = np.full((2, count, _MAX_AT_VERTEX), -1, dtype=np.int64)
    outs[start, 0], ins[stop, 0] = stop, start
    return _Boundary(mesh.vertices, front, existing, ins, outs, _unit(around))


def _propose_triangles(
    boundary: _Boundary,
    active: list[tuple[int, int]],
    candidates: Ints,
    tree: cKDTree,
    max_diameter: float,
) -> tuple[Ints, Ints, Floats]:
    """Return, for each boundary edge, the triangle with the smallest circumcircle, if any.

    Parameters
    ----------
    active : boundary edges to close.
    candidates : vertices that may become third corners.
    tree : all vertices of the mesh; none may lie inside the circumcircle.
    max_diameter : maximum diameter of the circumcircle, world units.

    Returns
    -------
    (n,) indices into `active` and (n,) third vertices, smallest circles first; (n, 3) unit
    normals.
    """
    from scipy.spatial import cKDTree

    edge = np.array(active, dtype=np.int64)
    own = np.array([boundary.front[e] for e in active])
    a, b = boundary.vertices[edge[:, 0]], boundary.vertices[edge[:, 1]]
    _, near = cKDTree(boundary.vertices[candidates]).query(
        0.5 * (a + b),
        k=range(1, min(_MAX_CANDIDATES, len(candidates)) + 1),
        distance_upper_bound=max_diameter,
    )
    row, column = np.nonzero(near < len(candidates))
    third = candidates[near[row, column]]
    a, b, c, own = a[row], b[row], boundary.vertices[third], own[row]
    crossed = np.cross(a - b, c - b)  # normal of the face (b, a, c)
    squared = np.maximum(_dot(crossed, crossed), 1e-30)
    sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))]
    radius = sides[0] * sides[1] * sides[2] / (2.0 * np.sqrt(squared))
    normal = _unit(crossed)
    good = (radius <= 0.5 * max_diameter) & (_dot(normal, own) > _MIN_COSINE)
    good &= _dot(normal, boundary.normals[third]) > _MIN_COSINE
    row, third, normal, radius, crossed, squared = (
        v[good] for v in (row, third, normal, radius, crossed, squared)
    )
    a, b, c = a[good] - b[good], c[good] - b[good], b[good]
    weighted = _dot(a, a)[:, None] * b - _dot(b, b)[:, None] * a
    centre = c + np.cross(weighted, crossed) / (2.0 * squared)[:, None]
    nearest, _ = tree.query(centre)
    empty = nearest > radius * (1.0 - _EPSILON)
    row, third, normal, radius = (v[empty] for v in (row, third, normal, radius))
    order = np.lexsort((third, radius, row))
    first = order[np.unique(row[order], return_index=True)[1]]
    first = first[np.lexsort((first, radius[first]))]
    return row[first], third[first], normal[first]


def _split_at(mesh: Mesh, vertices: Ints) -> Mesh:
    """Give each fan of the chosen vertices its own vertex; all other vertices must have one fan."""
    chosen = np.zeros(len(mesh.vertices), dtype=np.bool_)
    chosen[vertices] = True
    around = np.flatnonzero(chosen[mesh.faces].any(axis=1))
    part = mesh.faces[around]
    fan = fans(part)
    of_fan, first, number = np.unique(fan, return_index=True, return_inverse=True)
    vertex = part.ravel()[first].astype(np.int64)
    # The first fan keeps its vertex. Vertices that are not chosen may have more than one fan in
    # `part`, because `part` leaves out faces; these fans keep the vertex too.
    order = np.argsort(vertex, kind="stable")
    repeated = np.zeros(len(of_fan), dtype=np.bool_)
    repeated[order[1:]] = vertex[order[1:]] == vertex[order[:-1]]
    repeated &= chosen[vertex]
    new_vertex = vertex.copy()
    new_vertex[repeated] = len(mesh.vertices) + np.arange(int(repeated.sum()))
    faces = mesh.faces.copy()
    faces[around] = new_vertex[number.reshape(-1, 3)]
    return Mesh(np.concatenate([mesh.vertices, mesh.vertices[vertex[repeated]]]), faces)


def sew_gaps(mesh: Mesh, max_diameter: float) -> Mesh:
    """Close the gaps through which a ball of a given diameter does not fall.

    Parameters
    ----------
    mesh : manifold.
    max_diameter : diameter of the ball, world units; 0 closes nothing.

    Returns
    -------
    Mesh, manifold, with the same vertices; a vertex at which two boundaries meet is duplicated.
    """
    from scipy.spatial import cKDTree

    boundary = _find_boundary(mesh)
    tree = cKDTree(mesh.vertices)
    # Coincident vertices belong to surfaces that touch, not to a gap.
    vertices = np.unique(np.array(list(boundary.front), dtype=np.int64).reshape(-1, 2))
    if len(vertices) == 0 or max_diameter <= 0:
        return mesh
    apart = tree.query(mesh.vertices[vertices], k=2)[0][:, 1] > 0
    isolated = np.zeros(len(mesh.vertices), dtype=np.bool_)
    isolated[vertices] = apart
    active = [e for e in boundary.front if isolated[e[0]] and isolated[e[1]]]
    while active:
        candidates = np.flatnonzero(isolated & (boundary.outs.max(axis=1) >= 0))
        rows, thirds, normals = _propose_triangles(boundary, active, candidates, tree, max_diameter)
        repeated: list[tuple[int, int]] = []
        changed = False
        for row, third, normal in zip(rows.tolist(), thirds.tolist(), normals, strict=True):
            edge = active[row]
            if boundary.fits(edge, third):
                repeated += boundary.add_face(edge, third, normal)
                changed = True
            else:
                repeated.append(edge)
        # An edge without a proposal never gets one later, because the boundary only loses vertices.
        active = [e for e in dict.fromkeys(repeated) if e in boundary.front] if changed else []
    new = np.array(boundary.faces, dtype=np.int32).reshape(-1, 3)
    whole = Mesh(mesh.vertices, np.concatenate([mesh.faces, new]))
    return _split_at(whole, vertices)
