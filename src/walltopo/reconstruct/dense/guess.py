"""Holes that no photo measured are spanned by a guess, unless a photo looks through them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.core.parallel import ahead
from walltopo.geometry.mesh_check import degenerate
from walltopo.geometry.rays import Bvh
from walltopo.geometry.topology import Edges, edges_of
from walltopo.reconstruct.dense.membrane import membrane
from walltopo.reconstruct.dense.openings import Opening, find_openings
from walltopo.reconstruct.dense.scene import Scene

Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

# Rims of more vertices are left open: the time to span one grows with their third power.
_MOST_RIM = 1500

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
    spanned : holes and bays that were spanned.
    looked_through : those left open because photos look through them.
    """

    mesh: Mesh
    spanned: int
    looked_through: int


@dataclass(frozen=True, eq=False)
class _Span:
    """What may close one opening: new vertices, and faces whose indices below `len(rim)` are the
    rim's."""

    rim: Ints
    vertices: Floats
    faces: NDArray[np.int32]


def guess_holes(
    mesh: Mesh, scene: Scene, largest: float, edge: float, progress: Progress
) -> Guesses:
    """Span the holes of a mesh, and the bays of its border.

    Parameters
    ----------
    mesh : manifold, nothing guessed yet.
    scene : the photos' views and sparse points, same frame.
    largest : what has a bounding box of a longer diagonal stays open, world units; 0: all.
    edge : edge length of the new triangles, world units.
    """
    edges = edges_of(mesh.faces)
    openings = find_openings(mesh, edges, largest, edge)
    progress.step("spanning holes", len(openings))
    normals = _border_normals(mesh, edges)
    inner = _inner_edges(edges, len(mesh.vertices))
    spans = []
    for span in ahead(lambda opening: _span(mesh, opening, normals, inner, edge), openings):
        if span is not None:
            spans.append(span)
        progress.advance()
    shares = _shares(mesh, spans, scene, _BEHIND_EDGES * edge)
    kept = [s for s, share in zip(spans, shares.tolist(), strict=True) if share <= _MOST_THROUGH]
    return Guesses(_joined(mesh, kept), len(kept), len(spans) - len(kept))


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
    mesh: Mesh,
    opening: Opening,
    normals: dict[tuple[int, int], Floats],
    inner: Ints,
    edge: float,
) -> _Span | None:
    """A span that continues the surface around an opening; None where there is none."""
    rim = opening.rim
    points = np.concatenate([mesh.vertices[rim], opening.mouth])
    if len(points) > _MOST_RIM:
        return None
    outer, own = _outer(rim, len(points), normals)
    barred = _barred(rim, points, inner, _SAME_PLACE * edge)
    if barred[np.arange(len(points)), np.arange(1, len(points) + 1) % len(points)].any():
        return None  # a bay whose mouth is an edge already
    found = membrane(points, outer, barred, edge)
    if found is None:
        return None
    span = _Span(rim, np.concatenate([opening.mouth, found[0]]), found[1])
    patch = Mesh(np.concatenate([points, found[0]]), span.faces)
    if degenerate(patch, _FLATTEST).any():
        return None
    agrees = _agreement(patch, points, outer, own) >= opening.agreement
    return span if agrees else None


def _outer(
    rim: Ints, count: int, normals: dict[tuple[int, int], Floats]
) -> tuple[Floats, NDArray[np.bool_]]:
    """(count, 3) unit normals beyond the edges from each point to the next, and (count,) whether
    they are of faces: along a bay's mouth they are the mean of those at its ends."""
    around = zip(rim.tolist(), np.roll(rim, -1).tolist(), strict=True)
    faces = [normals.get(pair) for pair in around]
    own = np.zeros(count, dtype=np.bool_)
    own[: len(rim)] = [normal is not None for normal in faces]
    known = np.array([normal for normal in faces if normal is not None])
    beyond = known[0] + known[-1]
    outer = np.tile(beyond / max(float(np.linalg.norm(beyond)), 1e-30), (count, 1))
    outer[own] = known
    return outer, own


def _barred(rim: Ints, points: Floats, inner: Ints, apart: float) -> NDArray[np.bool_]:
    """(n, n) pairs of points that are an edge of the mesh already, or at one place.

    Parameters
    ----------
    rim : the vertices of the first points.
    """
    from scipy.spatial import cKDTree

    order = np.argsort(rim)
    mine = np.isin(inner, rim).all(axis=1)
    place = order[np.searchsorted(rim[order], inner[mine])]
    count = len(points)
    barred = np.zeros((count, count), dtype=np.bool_)
    same = cKDTree(points).query_pairs(apart, output_type="ndarray")
    same = same[~np.isin(same[:, 1] - same[:, 0], (1, count - 1))]
    for pairs in (place, same):
        barred[pairs[:, 0], pairs[:, 1]] = True
    return np.asarray(barred | barred.T)


def _agreement(patch: Mesh, points: Floats, outer: Floats, own: NDArray[np.bool_]) -> float:
    """Mean cosine, along the rim, between the span's faces and those of the mesh.

    Parameters
    ----------
    patch : the span, its first vertices the rim's; points, outer : see `triangulate_rim`;
        own : which of these edges are the mesh's.
    """
    n = len(points)
    after = np.roll(patch.faces, -1, axis=1)
    face, corner = np.nonzero((patch.faces < n) & (after == (patch.faces - 1) % n))
    mine = after[face, corner]  # the rim's edge runs from here to the next
    length = np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1)[mine] * own[mine]
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
    slack = [
        max(least, _BEHIND_SHARE * float(np.linalg.norm(np.ptp(mesh.vertices[item.rim], axis=0))))
        for item in spans
    ]
    return share_seen_through(mesh, alone, span, scene, np.array(slack))


# Each span is looked at in about this many of its faces.
_SAMPLES = 64


def share_seen_through(
    measured: Mesh, spans: Mesh, span: Ints, scene: Scene, tolerance: Floats
) -> Floats:
    """Of each span, how much of what photos see of it they look through.

    A photo looks through a span where it shows something behind it: the measured surface, or a
    sparse point that it observes.

    Parameters
    ----------
    measured : the mesh with its holes.
    spans : all spans as one mesh, same frame; span : (F,) number of each of its faces, ascending.
    tolerance : (number of spans,) what lies less than this behind a span lies on it, world units.

    Returns
    -------
    (number of spans,) share of the sight lines, over all photos; 0 where none sees the span.
    """
    count = len(tolerance)
    seen, through = np.zeros(count), np.zeros(count)
    if count == 0:
        return seen
    sample = _sample(span, count)
    surface, closed = Bvh(measured.vertices, measured.faces), Bvh(spans.vertices, spans.faces)
    for k, view in enumerate(scene.views):
        targets, number = spans.centroids[sample], span[sample]
        framed = _framed(view, targets)
        targets, number = targets[framed], number[framed]
        if len(targets) == 0:
            continue
        behind = _beyond(surface, view.centre, targets)
        here = behind > -tolerance[number]
        far = np.isfinite(behind) & (behind > tolerance[number])
        seen += np.bincount(number[here], minlength=count)
        through += np.bincount(number[far], minlength=count)
        points = scene.points[scene.seen[k]]
        rays = points - view.centre
        face, t = closed.first_hit(np.broadcast_to(view.centre, rays.shape), rays)
        hit = np.flatnonzero(face >= 0)
        number = span[face[hit]]
        before = (1.0 - t[hit]) * np.linalg.norm(rays[hit], axis=1) > tolerance[number]
        through += np.bincount(number[before], minlength=count)
    return np.asarray(np.minimum(through / np.maximum(seen, 1.0), 1.0))


def _sample(span: Ints, count: int) -> Ints:
    """Faces of every span, evenly over its order, at most twice `_SAMPLES` of each."""
    size = np.bincount(span, minlength=count)
    first = np.concatenate([[0], np.cumsum(size)])[:-1]
    step = np.maximum(size // _SAMPLES, 1)
    rank = np.arange(len(span)) - first[span]
    return np.flatnonzero(rank % step[span] == 0)


def _framed(view: View, points: Floats) -> NDArray[np.bool_]:
    """(n,) whether points lie in a photo."""
    pixels = np.nan_to_num(view.project(points), nan=-1.0)
    size = (view.camera.width, view.camera.height)
    return np.asarray(((pixels >= 0) & (pixels < size)).all(axis=1))


def _beyond(surface: Bvh, centre: Floats, targets: Floats) -> Floats:
    """(n,) how far behind each target the line of sight meets the surface; inf where it does not,
    negative where it meets it before."""
    rays = targets - centre
    _, t = surface.first_hit(np.broadcast_to(centre, rays.shape), rays)
    return np.asarray((t - 1.0) * np.linalg.norm(rays, axis=1))
