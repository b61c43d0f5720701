"""Thin gaps in a mesh are sewn up, however long they are and wherever they lead.

After Bernardini et al., "The ball-pivoting algorithm for surface reconstruction", 1999: a ball that
rolls over the mesh and does not fall through rests on three border vertices, and they become a
triangle. No vertex is added, and a ball falls through every gap wider than itself.
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

# Border vertices near an edge that may become the third corner of its triangle.
_NEAREST = 24
# A new face turns by no more than this (cosine) from the faces at both sides of the gap.
_LEAST_COSINE = 0.3
# Border edges to a vertex, and from it; more meet nowhere that is worth sewing.
_AT_ONE = 4
# Ways that differ by less than this angle are one, and other vertices may reach into a new face's
# circle by this share.
_SAME_WAY = 1e-6


@kernel
def _leads_into_gap(
    vertices: Floats, ins: Ints, outs: Ints, normal: Floats, here: int, there: int
) -> bool:
    """Whether the way from a border vertex to another begins in a gap.

    Faces lie on the left of their border edges: turning left from a way through the gap, the
    first edge met leads away from the vertex, and turning right, to it.

    Parameters
    ----------
    ins, outs : (V, _AT_ONE) border edges at each vertex as the other end, -1 = none.
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
            # 0 .. 2 pi, times the same length for both
            along = ex * wx + ey * wy + ez * wz
            turn = np.arctan2(ex * lx + ey * ly + ez * lz, along * length)
            turn = turn % (2.0 * np.pi)
            on_it = other == there or min(turn, 2.0 * np.pi - turn) < _SAME_WAY
            if leads_out:
                first_out = min(first_out, 0.0 if on_it else turn)
            elif not on_it:
                first_in = min(first_in, turn)
    return first_out < first_in


@dataclass
class _Seam:
    """The border while it is sewn.

    Parameters
    ----------
    vertices : (V, 3), of the mesh.
    front : border edge (start, stop), in the direction of its face, to that face's unit normal.
    joined : every edge between border vertices, smaller vertex first.
    ins, outs : (V, _AT_ONE) other ends of the border edges that lead to and from a vertex.
    around : (V, 3) sum of the normals at the border edges of a vertex.
    faces : the new ones.
    """

    vertices: Floats
    front: dict[tuple[int, int], Floats]
    joined: set[tuple[int, int]]
    ins: Ints
    outs: Ints
    around: Floats
    faces: list[tuple[int, int, int]] = field(default_factory=list)

    def fits(self, edge: tuple[int, int], third: int) -> bool:
        """Whether the triangle over a border edge lies in a gap and leaves every edge with at
        most two faces."""
        if edge not in self.front or self.outs[third].max() < 0:
            return False
        for side in ((third, edge[0]), (edge[1], third)):
            if side in self.front:
                continue
            if _ordered(side) in self.joined or not (self._room(side) and self._open(side)):
                return False
        return self._open((third, edge[0])) and self._open((edge[1], third))

    def _open(self, side: tuple[int, int]) -> bool:
        return all(
            _leads_into_gap(self.vertices, self.ins, self.outs, self.around[a], a, b)
            for a, b in (side, side[::-1])
        )

    def _room(self, side: tuple[int, int]) -> bool:
        return bool((self.ins[side[0]] < 0).any() and (self.outs[side[1]] < 0).any())

    def _change(self, table: Ints, vertex: int, old: int, new: int) -> None:
        table[vertex, int((table[vertex] == old).argmax())] = new

    def _close(self, edge: tuple[int, int]) -> None:
        del self.front[edge]
        self._change(self.outs, edge[0], edge[1], -1)
        self._change(self.ins, edge[1], edge[0], -1)

    def sew(self, edge: tuple[int, int], third: int, normal: Floats) -> list[tuple[int, int]]:
        """Add a triangle that fits; the border edges it makes."""
        self._close(edge)
        made = []
        for side in ((third, edge[0]), (edge[1], third)):
            if side in self.front:
                self._close(side)
            else:
                new = side[::-1]
                self.front[new] = normal
                self._change(self.outs, new[0], -1, new[1])
                self._change(self.ins, new[1], -1, new[0])
                self.joined.add(_ordered(new))
                made.append(new)
        self.faces.append((edge[1], edge[0], third))
        return made


def _ordered(edge: tuple[int, int]) -> tuple[int, int]:
    return edge if edge[0] < edge[1] else edge[::-1]


def _unit(vectors: Floats) -> Floats:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray((a * b).sum(axis=-1))


def _border(mesh: Mesh) -> _Seam:
    """The mesh's border, none of it sewn."""
    edges = edges_of(mesh.faces)
    face, corner = np.nonzero((edges.count == 1)[edges.of_face])
    start, stop = mesh.faces[face, corner], mesh.faces[face, (corner + 1) % 3]
    a, b, c = (mesh.vertices[mesh.faces[face, k]] for k in range(3))
    normal = _unit(np.cross(b - a, c - a))
    front = dict(zip(zip(start.tolist(), stop.tolist(), strict=True), normal, strict=True))
    count = len(mesh.vertices)
    at_border, around = np.zeros(count, dtype=np.bool_), np.zeros((count, 3))
    at_border[start] = True
    np.add.at(around, start, normal)
    np.add.at(around, stop, normal)
    inner = at_border[edges.pairs].all(axis=1)
    joined = set(map(tuple, edges.pairs[inner].tolist()))
    ins, outs = np.full((2, count, _AT_ONE), -1, dtype=np.int64)
    outs[start, 0], ins[stop, 0] = stop, start
    return _Seam(mesh.vertices, front, joined, ins, outs, _unit(around))


def _proposals(
    seam: _Seam, active: list[tuple[int, int]], border: Ints, everything: cKDTree, widest: float
) -> tuple[Ints, Ints, Floats]:
    """The triangle with the smallest circle over each border edge that has one.

    Parameters
    ----------
    active : the edges.
    border : vertices that may become third corners.
    everything : all vertices of the mesh; none may lie within the circle.
    widest : its largest diameter.

    Returns
    -------
    (n,) index into `active` and (n,) third vertices, the smallest circles first; (n, 3) unit
    normals.
    """
    from scipy.spatial import cKDTree

    edge = np.array(active, dtype=np.int64)
    own = np.array([seam.front[e] for e in active])
    a, b = seam.vertices[edge[:, 0]], seam.vertices[edge[:, 1]]
    _, near = cKDTree(seam.vertices[border]).query(
        0.5 * (a + b), k=range(1, min(_NEAREST, len(border)) + 1), distance_upper_bound=widest
    )
    row, column = np.nonzero(near < len(border))
    third = border[near[row, column]]
    a, b, c, own = a[row], b[row], seam.vertices[third], own[row]
    crossed = np.cross(a - b, c - b)  # of the face (b, a, c)
    squared = np.maximum(_dot(crossed, crossed), 1e-30)
    sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))]
    radius = sides[0] * sides[1] * sides[2] / (2.0 * np.sqrt(squared))
    normal = _unit(crossed)
    good = (radius <= 0.5 * widest) & (_dot(normal, own) > _LEAST_COSINE)
    good &= _dot(normal, seam.around[third]) > _LEAST_COSINE
    row, third, normal, radius, crossed, squared = (
        v[good] for v in (row, third, normal, radius, crossed, squared)
    )
    a, b, c = a[good] - b[good], c[good] - b[good], b[good]
    weighted = _dot(a, a)[:, None] * b - _dot(b, b)[:, None] * a
    centre = c + np.cross(weighted, crossed) / (2.0 * squared)[:, None]
    nearest, _ = everything.query(centre)
    empty = nearest > radius * (1.0 - _SAME_WAY)
    row, third, normal, radius = (v[empty] for v in (row, third, normal, radius))
    order = np.lexsort((third, radius, row))
    first = order[np.unique(row[order], return_index=True)[1]]
    first = first[np.lexsort((first, radius[first]))]
    return row[first], third[first], normal[first]


def _split_at(mesh: Mesh, vertices: Ints) -> Mesh:
    """Give each fan of some vertices its own vertex; the others must have one fan each."""
    chosen = np.zeros(len(mesh.vertices), dtype=np.bool_)
    chosen[vertices] = True
    around = np.flatnonzero(chosen[mesh.faces].any(axis=1))
    part = mesh.faces[around]
    fan = fans(part)
    of_fan, first, number = np.unique(fan, return_index=True, return_inverse=True)
    vertex = part.ravel()[first].astype(np.int64)
    # The first fan keeps the vertex. Fans of the other vertices are cut by leaving faces out.
    order = np.argsort(vertex, kind="stable")
    again = np.zeros(len(of_fan), dtype=np.bool_)
    again[order[1:]] = vertex[order[1:]] == vertex[order[:-1]]
    again &= chosen[vertex]
    name = vertex.copy()
    name[again] = len(mesh.vertices) + np.arange(int(again.sum()))
    faces = mesh.faces.copy()
    faces[around] = name[number.reshape(-1, 3)]
    return Mesh(np.concatenate([mesh.vertices, mesh.vertices[vertex[again]]]), faces)


def sew_gaps(mesh: Mesh, widest: float) -> Mesh:
    """Close the gaps that a ball of a diameter does not fall through.

    Parameters
    ----------
    mesh : manifold.
    widest : the ball's diameter, world units; 0 closes none.

    Returns
    -------
    Mesh, manifold, with the same vertices or, where two borders meet in one, copies of them.
    """
    from scipy.spatial import cKDTree

    seam = _border(mesh)
    everything = cKDTree(mesh.vertices)
    # Where vertices coincide, surfaces touch, and each would take the other for a gap.
    vertices = np.unique(np.array(list(seam.front), dtype=np.int64).reshape(-1, 2))
    if len(vertices) == 0 or widest <= 0:
        return mesh
    apart = everything.query(mesh.vertices[vertices], k=2)[0][:, 1] > 0
    alone = np.zeros(len(mesh.vertices), dtype=np.bool_)
    alone[vertices] = apart
    active = [e for e in seam.front if alone[e[0]] and alone[e[1]]]
    while active:
        border = np.flatnonzero(alone & (seam.outs.max(axis=1) >= 0))
        rows, thirds, normals = _proposals(seam, active, border, everything, widest)
        again: list[tuple[int, int]] = []
        sewn = False
        for row, third, normal in zip(rows.tolist(), thirds.tolist(), normals, strict=True):
            edge = active[row]
            if seam.fits(edge, third):
                again += seam.sew(edge, third, normal)
                sewn = True
            else:
                again.append(edge)
        # Edges without a proposal have none later either: the border only loses vertices.
        active = [e for e in dict.fromkeys(again) if e in seam.front] if sewn else []
    new = np.array(seam.faces, dtype=np.int32).reshape(-1, 3)
    whole = Mesh(mesh.vertices, np.concatenate([mesh.faces, new]))
    return _split_at(whole, vertices)
