"""Compute the edges, neighbours, boundaries and fans of a triangle mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.graphs import (
    grouped_edges,
    join_components,
    linked_components,
    number_components,
)
from walltopo.geometry.kernels import in_ranges, kernel

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Edges:
    """The undirected edges of a mesh.

    Parameters
    ----------
    pairs : (E, 2) int32 vertices, smaller first.
    count : (E,) int32 faces at each edge; 1 = boundary, > 2 = non-manifold.
    of_face : (F, 3) int32 index of the edge from corner k to corner k + 1.
    """

    pairs: NDArray[np.int32]
    count: NDArray[np.int32]
    of_face: NDArray[np.int32]


def edges_of(faces: NDArray[np.integer]) -> Edges:
    """Return the undirected edges of (F, 3) faces."""
    return Edges(*grouped_edges(faces))


def edge_lengths(vertices: Floats, edges: Edges) -> NDArray[np.float64]:
    """Return the (E,) lengths of the edges of a mesh with (V, 3) vertices."""
    lengths = np.empty(len(edges.pairs))
    in_ranges(_edge_lengths, len(lengths), vertices, edges.pairs, lengths)
    return lengths


def side_lengths(mesh: Mesh) -> NDArray[np.float64]:
    """Return (F, 3) lengths of the sides from corner k to corner k + 1."""
    lengths = np.empty((len(mesh.faces), 3))
    in_ranges(_side_lengths, len(lengths), mesh.vertices, mesh.faces, lengths)
    return lengths


@kernel
def _distance(vertices: Any, a: Any, b: Any) -> Any:
    x, y = vertices[a, 0] - vertices[b, 0], vertices[a, 1] - vertices[b, 1]
    z = vertices[a, 2] - vertices[b, 2]
    return np.sqrt(x * x + y * y + z * z)


@kernel
def _edge_lengths(begin: Any, end: Any, vertices: Any, pairs: Any, lengths: Any) -> None:
    for e in range(begin, end):
        lengths[e] = _distance(vertices, pairs[e, 0], pairs[e, 1])


@kernel
def _side_lengths(begin: Any, end: Any, vertices: Any, faces: Any, lengths: Any) -> None:
    for f in range(begin, end):
        for k in range(3):
            lengths[f, k] = _distance(vertices, faces[f, k], faces[f, (k + 1) % 3])


def vertex_components(faces: NDArray[np.integer], count: int) -> NDArray[np.int32]:
    """Return (count,) the component of each vertex; faces that share a vertex are connected."""
    first, second = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    return linked_components(count, first, second)


def fans(faces: Faces, edges: Edges | None = None) -> NDArray[np.int32]:
    """Return (F, 3) the fan of each corner: corners at one vertex connected by manifold edges.

    A vertex with more than one fan is non-manifold.
    """
    edges = edges if edges is not None else edges_of(faces)
    first, second = np.zeros((2, len(edges.count)), dtype=np.int32)
    _two_of_each(edges.of_face, first, second)
    shared = edges.count == 2
    return glued_fans(faces, first[shared], second[shared])


def glued_fans(
    faces: NDArray[np.integer], first: NDArray[np.int64], second: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Return (F, 3) the fan of each corner, where faces are connected only at the given edges.

    Parameters
    ----------
    first, second : (n,) pairs of half-edges that form one edge; half-edge 3 f + k runs from corner
        k of face f to corner k + 1.
    """
    parent = np.arange(3 * len(faces), dtype=np.int32)
    one, other = np.ascontiguousarray(first, np.int32), np.ascontiguousarray(second, np.int32)
    return _glued(np.ascontiguousarray(faces, np.int32), one, other, parent).reshape(-1, 3)


@kernel
def _two_of_each(of_face: Any, first: Any, second: Any) -> None:
    """Fill the first and the last half-edge of each edge."""
    edge = of_face.ravel()
    for slot in range(len(edge)):
        second[edge[slot]] = slot
    for slot in range(len(edge) - 1, -1, -1):
        first[edge[slot]] = slot


@kernel
def _glued(faces: Any, first: Any, second: Any, parent: Any) -> Any:
    """Return the fan of each corner; `parent` holds the corners' own numbers."""
    vertex = faces.ravel()
    for e in range(len(first)):
        # Both faces share both ends of an edge: link the corners at the same vertex.
        start, mate = first[e], second[e]
        stop, mate_stop = start - start % 3 + (start + 1) % 3, mate - mate % 3 + (mate + 1) % 3
        if vertex[start] != vertex[mate]:
            mate, mate_stop = mate_stop, mate
        join_components(parent, start, mate)
        join_components(parent, stop, mate_stop)
    return number_components(parent)


def opposite_half_edges(faces: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return pairs (n,), (n,) of half-edges that run in opposite directions along one edge.

    Each edge contributes its first half-edge of either direction; others have no partner.
    """
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel()
    low, high, forward = np.minimum(start, end), np.maximum(start, end), start < end
    key = low * (int(faces.max(initial=0)) + 1) + high
    order = np.lexsort((~forward, key))
    key, forward = key[order], forward[order]
    directed = key * 2 + forward
    head = np.flatnonzero(np.r_[True, directed[1:] != directed[:-1]])
    first, key, forward = order[head], key[head], forward[head]
    both = np.flatnonzero((key[1:] == key[:-1]) & forward[:-1])
    return first[both], first[both + 1]


def split_fans(mesh: Mesh, fan: Faces | None = None) -> Mesh:
    """Give each fan its own vertex, so that surfaces that touch in a vertex separate.

    Parameters
    ----------
    fan : (F, 3) result of `fans` (default) or of `glued_fans`.
    """
    fan = fans(mesh.faces) if fan is None else fan
    flat = fan.ravel()
    corner = np.zeros(int(flat.max(initial=-1)) + 1, dtype=np.int32)
    corner[flat] = mesh.faces.ravel()
    return Mesh(mesh.vertices[corner], fan)


def compact_vertices(vertices: Floats, faces: NDArray[np.integer]) -> tuple[Floats, Faces]:
    """Return the vertices that faces use, and the faces with new indices."""
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[faces] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    return vertices[used], number[faces].astype(np.int32)


def part_of_mesh(mesh: Mesh, chosen: NDArray[np.bool_]) -> Mesh:
    """Return the mesh of the (F,) chosen faces, in their order, without unused vertices."""
    vertices, faces = compact_vertices(mesh.vertices, mesh.faces[chosen])
    colours = mesh.vertex_colours
    if colours is not None:
        used = np.zeros(len(colours), dtype=np.bool_)
        used[mesh.faces[chosen]] = True
        colours = colours[used]
    return Mesh(vertices, faces, colours, ~mesh.measured[chosen])


def faces_touching(mesh: Mesh, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (F,) whether each face shares a vertex with the chosen ones; these do.

    Parameters
    ----------
    chosen : (F,) bool, or indices of faces.
    """
    touched = np.zeros(len(mesh.vertices), dtype=np.bool_)
    touched[mesh.faces[chosen]] = True
    return np.asarray(touched[mesh.faces].any(axis=1))


def joined_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """Return several meshes as one, their faces in that order; coloured if all of them are."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    colours = [mesh.vertex_colours for mesh in meshes]
    coloured = all(part is not None for part in colours)
    return Mesh(
        np.vstack([mesh.vertices for mesh in meshes]),
        np.vstack([mesh.faces + k for mesh, k in zip(meshes, first, strict=True)]).astype(np.int32),
        np.vstack([part for part in colours if part is not None]) if coloured else None,
        np.concatenate([~mesh.measured for mesh in meshes]),
    )


Ints = NDArray[np.int32]


def face_neighbours(faces: NDArray[np.integer]) -> Ints:
    """Return the faces across each edge.

    Parameters
    ----------
    faces : (F, 3), some or all faces of a mesh.

    Returns
    -------
    (F, 3) int32, face that shares the edge from corner k to corner k + 1, -1 = none; the first one
    at non-manifold edges.
    """
    return _neighbours(np.ascontiguousarray(faces, np.int32), int(faces.max(initial=-1)) + 1)


def patches(neighbours: Ints, label: NDArray[np.integer]) -> tuple[Ints, Ints]:
    """Return the connected patches of faces with equal labels.

    Parameters
    ----------
    neighbours : (F, 3) result of `face_neighbours`.
    label : (F,).

    Returns
    -------
    (F,) int32, patch of each face, numbered in the order of first faces; and the first faces.
    """
    parent = np.arange(len(label), dtype=np.int32)
    return _patches(neighbours, np.ascontiguousarray(label, np.int32), parent)


def face_components(faces: NDArray[np.integer]) -> Ints:
    """Return (F,) the component of each face; faces that share an edge are connected."""
    return patches(face_neighbours(faces), np.zeros(len(faces), dtype=np.int32))[0]


@kernel
def _neighbours(faces: Any, vertices: Any) -> Any:
    count = len(faces)
    starts = np.zeros(vertices + 1, dtype=np.int32)
    for f in range(count):
        for k in range(3):
            starts[min(faces[f, k], faces[f, (k + 1) % 3]) + 1] += 1
    for v in range(vertices):
        starts[v + 1] += starts[v]
    # Edges grouped by their lower vertex: (upper vertex, face, corner).
    upper = np.zeros(3 * count, dtype=np.int32)
    edge = np.zeros(3 * count, dtype=np.int32)
    place = starts[:-1].copy()
    for f in range(count):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            at = place[min(a, b)]
            place[min(a, b)] += 1
            upper[at], edge[at] = max(a, b), 3 * f + k
    found = np.full((count, 3), -1, dtype=np.int32)
    for v in range(vertices):
        for i in range(starts[v], starts[v + 1]):
            for j in range(starts[v], starts[v + 1]):
                other = edge[j] // 3
                if i != j and upper[i] == upper[j] and other != edge[i] // 3:
                    found[edge[i] // 3, edge[i] % 3] = other
                    break
    return found


@kernel
def _patches(neighbours: Any, label: Any, parent: Any) -> Any:
    for f in range(len(label)):
        for k in range(3):
            other = neighbours[f, k]
            if other >= 0 and label[other] == label[f]:
                join_components(parent, f, other)
    number = number_components(parent)
    first = np.zeros(number.max() + 1 if len(number) else 0, dtype=np.int32)
    for f in range(len(number) - 1, -1, -1):
        first[number[f]] = f
    return number, first


AnyFaces = NDArray[np.integer]


def boundary_loops(faces: AnyFaces, edges: Edges | None = None) -> list[NDArray[np.int64]]:
    """Return the closed chains of boundary vertices, in the direction of the faces' edges.

    The mesh must be vertex-manifold (see `fans`); chains through a non-manifold vertex are skipped.
    """
    edges = edges if edges is not None else edges_of(faces)
    border = (edges.count == 1)[edges.of_face]
    starts = faces[border]
    stops = np.roll(faces, -1, axis=1)[border]
    follow = dict(zip(starts.tolist(), stops.tolist(), strict=True))
    if len(follow) != len(starts):
        repeated = np.flatnonzero(np.bincount(starts) > 1).tolist()
        for vertex in repeated:
            follow.pop(vertex, None)
    loops: list[NDArray[np.int64]] = []
    while follow:
        first, current = follow.popitem()
        loop = [first]
        while current != first and current in follow:
            loop.append(current)
            current = follow.pop(current)
        if current == first and len(loop) >= 3:
            loops.append(np.array(loop, dtype=np.int64))
    return loops


def close_loops(
    vertices: Floats, faces: AnyFaces, loops: Iterable[NDArray[np.int64]]
) -> tuple[Floats, NDArray[np.int32]]:
    """Close boundary loops with a fan around the centroid, or one face for three vertices.

    Parameters
    ----------
    vertices, faces : (V, 3) and (F, 3), of a manifold mesh.
    loops : results of `boundary_loops` to close.

    Returns
    -------
    Vertices and faces; existing ones keep their indices.
    """
    points, found = [vertices], [faces.astype(np.int32)]
    count = len(vertices)
    for loop in loops:
        if len(loop) == 3:
            found.append(loop[None, ::-1].astype(np.int32))
            continue
        points.append(vertices[loop].mean(axis=0, keepdims=True))
        fan = np.stack([np.roll(loop, -1), loop, np.full(len(loop), count)], axis=1)
        found.append(fan.astype(np.int32))
        count += 1
    return np.concatenate(points), np.concatenate(found)


def shared_corners(
    faces: NDArray[np.integer], values: NDArray[np.integer], vertices: int
) -> tuple[NDArray[np.int32], NDArray[np.uint32]]:
    """Number the distinct pairs of a vertex and a value among the corners of triangles.

    Parameters
    ----------
    faces : (F, 3), indices below `vertices`.
    values : (F, 3) >= 0, value of each corner, such as its chart.

    Returns
    -------
    (N,) first corner of each pair, an index into the 3 F corners; pairs are sorted by vertex and
    value. (F, 3) pair of each corner.
    """
    return _shared(
        np.ascontiguousarray(faces, np.int32), np.ascontiguousarray(values, np.uint64), vertices
    )


@kernel
def _shared(faces: Any, values: Any, vertices: Any) -> Any:
    corners = 3 * len(faces)
    vertex, value = faces.ravel(), values.ravel()
    # Group the corners by vertex, in ascending order.
    starts = np.zeros(vertices + 1, dtype=np.int32)
    for k in range(corners):
        starts[vertex[k] + 1] += 1
    for v in range(vertices):
        starts[v + 1] += starts[v]
    order = np.zeros(corners, dtype=np.int32)
    place = starts[:-1].copy()
    for k in range(corners):
        order[place[vertex[k]]] = k
        place[vertex[k]] += 1
    first = np.zeros(corners, dtype=np.int32)
    number = np.zeros((len(faces), 3), dtype=np.uint32)
    count = 0
    for v in range(vertices):
        # Insertion sort: it is stable, and a vertex has about six corners.
        for i in range(starts[v] + 1, starts[v + 1]):
            corner, j = order[i], i
            while j > starts[v] and value[order[j - 1]] > value[corner]:
                order[j] = order[j - 1]
                j -= 1
            order[j] = corner
        for i in range(starts[v], starts[v + 1]):
            corner = order[i]
            if i == starts[v] or value[corner] != value[order[i - 1]]:
                first[count] = corner
                count += 1
            number[corner // 3, corner % 3] = count - 1
    return first[:count].copy(), number


def bounds_by_group(
    group: NDArray[np.integer], corners: Iterable[NDArray[np.floating]], count: int
) -> tuple[Floats, Floats]:
    """Return the (count, k) lowest and highest coordinates of each group; inf, -inf if it is empty.

    Parameters
    ----------
    group : (n,) group of each item, from 0 to `count` - 1.
    corners : (n, k) points of the items, one array per corner; each is read once, so that a
        generator bounds the memory.
    """
    order = np.argsort(group, kind="stable")
    ordered = group[order]
    starts = np.flatnonzero(np.diff(ordered, prepend=-1))
    sorted_corners = (points[order] for points in corners)
    ends = [
        (np.minimum.reduceat(p, starts), np.maximum.reduceat(p, starts)) for p in sorted_corners
    ]
    lows, highs = zip(*ends, strict=True)
    low = np.full((count, lows[0].shape[1]), np.inf)
    high = -low
    low[ordered[starts]], high[ordered[starts]] = np.min(lows, axis=0), np.max(highs, axis=0)
    return low, high
