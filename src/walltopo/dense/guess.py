"""Holes that no photo measured are spanned by a guess, and its triangles are marked so.

A hole is spanned where its rim can be (`membrane`), where the span continues the surface around
it, and where no photo looks through it. The measured triangles stay as they are, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress
from walltopo.dense.membrane import membrane
from walltopo.dense.scene import Scene
from walltopo.dense.seen_through import share_seen_through
from walltopo.meshes.check import degenerate
from walltopo.meshes.holes import boundary_loops
from walltopo.meshes.topology import Edges, edges_of, vertex_parts

__all__ = ["Guesses", "guess_holes"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Rims of more vertices are left open: the time to span one grows with their third power.
_MOST_RIM = 1500
# Mean cosine, along the rim, between a span and the surface that it continues; rims are rough. A
# span over a piece's own outline lies on its back: where it is no hole, this is far below zero.
_LEAST_AGREEMENT = -0.5
_LEAST_AGREEMENT_OF_OUTLINE = 0.3
# Rim vertices nearer than this many edges are one place, and no edge joins them.
_SAME_PLACE = 0.05
# No face of a span may be flatter: height over longest side, well above what a file's rounding
# takes away.
_FLATTEST = 1e-5
# A span goes where photos look through this share of it.
_MOST_THROUGH = 0.2
# What lies less behind a span than this many edges, and than this share of its diameter, is the
# bottom of what it spans: a pocket is no opening.
_BEHIND_EDGES = 4.0
_BEHIND_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class Guesses:
    """A mesh with its holes spanned.

    Parameters
    ----------
    mesh : the measured vertices and faces first, as they were; `guessed` names the others.
    spanned : holes that were spanned.
    looked_through : holes left open because photos look through them.
    """

    mesh: Mesh
    spanned: int
    looked_through: int


@dataclass(frozen=True, eq=False)
class _Span:
    """What may close one hole: new vertices, and faces whose indices below `len(rim)` are the
    rim's."""

    rim: Ints
    vertices: Floats
    faces: NDArray[np.int32]


def guess_holes(
    mesh: Mesh, scene: Scene, largest: float, edge: float, progress: Progress
) -> Guesses:
    """Span the holes of a mesh.

    Parameters
    ----------
    mesh : manifold, nothing guessed yet.
    scene : the photos' views and sparse points, same frame.
    largest : holes whose bounding box has a longer diagonal stay open, world units; 0: all.
    edge : edge length of the new triangles, world units.
    """
    edges = edges_of(mesh.faces)
    loops = boundary_loops(mesh.faces, edges)
    size = np.array([_size(mesh, loop) for loop in loops])
    part = vertex_parts(mesh.faces, len(mesh.vertices))[[loop[0] for loop in loops]]
    outline = size == _largest_of(part, size)
    progress.step("spanning holes", int((size <= largest).sum()))
    normals = _border_normals(mesh, edges)
    inner = _inner_edges(edges, len(mesh.vertices))
    spans = []
    for k in np.flatnonzero(size <= largest).tolist():
        least = _LEAST_AGREEMENT_OF_OUTLINE if outline[k] else _LEAST_AGREEMENT
        span, agreement = _span(mesh, loops[k], normals, inner, edge)
        if span is not None and agreement >= least:
            spans.append(span)
        progress.advance()
    shares = _shares(mesh, spans, scene, _BEHIND_EDGES * edge)
    kept = [s for s, share in zip(spans, shares.tolist(), strict=True) if share <= _MOST_THROUGH]
    return Guesses(_joined(mesh, kept), len(kept), len(spans) - len(kept))


def _size(mesh: Mesh, loop: Ints) -> float:
    """Diagonal of the loop's bounding box."""
    return float(np.linalg.norm(np.ptp(mesh.vertices[loop], axis=0)))


def _largest_of(part: NDArray[np.int32], size: Floats) -> Floats:
    """(n,) the largest size in each one's part."""
    largest = np.zeros(int(part.max(initial=-1)) + 1)
    np.maximum.at(largest, part, size)
    return largest[part]


def _border_normals(mesh: Mesh, edges: Edges) -> dict[tuple[int, int], Floats]:
    """Border edge, in the direction of its face, to that face's unit normal."""
    face, corner = np.nonzero((edges.count == 1)[edges.of_face])
    start, stop = mesh.faces[face, corner], mesh.faces[face, (corner + 1) % 3]
    pairs = zip(start.tolist(), stop.tolist(), strict=True)
    return dict(zip(pairs, mesh.normals[face], strict=True))


def _inner_edges(edges: Edges, count: int) -> Ints:
    """(E, 2) edges between border vertices that are no border themselves."""
    at_border = np.zeros(count, dtype=np.bool_)
    at_border[edges.pairs[edges.count == 1]] = True
    return edges.pairs[(edges.count > 1) & at_border[edges.pairs].all(axis=1)]


def _span(
    mesh: Mesh, rim: Ints, normals: dict[tuple[int, int], Floats], inner: Ints, edge: float
) -> tuple[_Span | None, float]:
    """A span over a rim, None where there is none, and how it agrees with the surface around."""
    if len(rim) > _MOST_RIM:
        return None, 0.0
    around = zip(rim.tolist(), np.roll(rim, -1).tolist(), strict=True)
    outer = np.array([normals[pair] for pair in around])
    points = mesh.vertices[rim]
    found = membrane(points, outer, _barred(rim, points, inner, _SAME_PLACE * edge), edge)
    if found is None:
        return None, 0.0
    span = _Span(rim, *found)
    patch = Mesh(np.concatenate([points, span.vertices]), span.faces)
    if degenerate(patch, _FLATTEST).any():
        return None, 0.0
    return span, _agreement(patch, points, outer)


def _barred(rim: Ints, points: Floats, inner: Ints, apart: float) -> NDArray[np.bool_]:
    """(n, n) pairs of rim vertices that are an edge of the mesh already, or at one place."""
    from scipy.spatial import cKDTree

    order = np.argsort(rim)
    mine = np.isin(inner, rim).all(axis=1)
    place = order[np.searchsorted(rim[order], inner[mine])]
    barred = np.zeros((len(rim), len(rim)), dtype=np.bool_)
    same = cKDTree(points).query_pairs(apart, output_type="ndarray")
    same = same[~np.isin(same[:, 1] - same[:, 0], (1, len(rim) - 1))]
    for pairs in (place, same):
        barred[pairs[:, 0], pairs[:, 1]] = True
    return np.asarray(barred | barred.T)


def _agreement(patch: Mesh, points: Floats, outer: Floats) -> float:
    """Mean cosine, along the rim, between the span's faces and those of the mesh.

    Parameters
    ----------
    patch : the span, its first vertices the rim's; points, outer : see `triangulate_rim`.
    """
    n = len(points)
    after = np.roll(patch.faces, -1, axis=1)
    face, corner = np.nonzero((patch.faces < n) & (after == (patch.faces - 1) % n))
    mine = after[face, corner]  # the rim's edge runs from here to the next
    length = np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1)[mine]
    cosine = (patch.normals[face] * outer[mine]).sum(axis=1)
    return float((cosine * length).sum() / max(float(length.sum()), 1e-30))


def _joined(mesh: Mesh, spans: list[_Span]) -> Mesh:
    """The mesh and all spans; the mesh itself where there are none."""
    if not spans:
        return mesh
    vertices, faces, count = [mesh.vertices], [mesh.faces], len(mesh.vertices)
    for span in spans:
        number = np.concatenate([span.rim, count + np.arange(len(span.vertices))])
        vertices.append(span.vertices)
        faces.append(number[span.faces].astype(np.int32))
        count += len(span.vertices)
    guessed = np.arange(sum(map(len, faces))) >= len(mesh.faces)
    return Mesh(np.concatenate(vertices), np.concatenate(faces), None, guessed)


def _shares(mesh: Mesh, spans: list[_Span], scene: Scene, least: float) -> Floats:
    """How much of each span photos look through (see `share_seen_through`)."""
    joined = _joined(mesh, spans)
    alone = Mesh(joined.vertices, joined.faces[~joined.measured])
    span = np.repeat(np.arange(len(spans)), [len(item.faces) for item in spans])
    sizes = np.array([_BEHIND_SHARE * _size(mesh, item.rim) for item in spans])
    return share_seen_through(mesh, alone, span, scene, np.maximum(sizes, least))
