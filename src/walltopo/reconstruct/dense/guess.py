"""Span the holes of a mesh with guessed faces, except holes that a photo looks through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.core.parallel import map_ahead
from walltopo.geometry.mesh_check import degenerate
from walltopo.geometry.rays import Bvh
from walltopo.geometry.topology import Edges, edges_of
from walltopo.reconstruct.dense.membrane import membrane
from walltopo.reconstruct.dense.openings import Opening, find_openings
from walltopo.reconstruct.dense.scene import Scene

Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

# Rims with more vertices stay open: the time to span one grows with their third power.
_MAX_RIM = 1500

# Rim vertices closer than this many edges count as coincident, and no new edge joins them.
_SAME_PLACE = 0.05

# Minimum height over longest side of a new face; well above the rounding of the mesh file.
_MIN_FLATNESS = 1e-5

# A span is dropped if photos look through more than this share of it.
_MAX_THROUGH = 0.2

# A surface counts as seen through a span only if it lies farther behind the span than this many
# edges and this share of the span's diameter. Otherwise it is the bottom of a pocket.
_BEHIND_EDGES = 4.0

_BEHIND_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class Guesses:
    """A mesh with its holes spanned.

    Parameters
    ----------
    mesh : measured vertices and faces first, unchanged; `guessed` marks the others.
    spanned : number of holes and bays that were spanned.
    seen_through : number of holes and bays left open because photos look through them.
    """

    mesh: Mesh
    spanned: int
    seen_through: int


@dataclass(frozen=True, eq=False)
class _Span:
    """New vertices and faces over one opening; indices below `len(rim)` are rim vertices."""

    rim: Ints
    vertices: Floats
    faces: NDArray[np.int32]


def guess_holes(
    mesh: Mesh, scene: Scene, largest: float, edge: float, progress: Progress
) -> Guesses:
    """Span the holes of a mesh and the bays of its boundary.

    Parameters
    ----------
    mesh : manifold, without guessed faces.
    scene : the photos' views and sparse points, same frame.
    largest : openings whose bounding box has a longer diagonal stay open, world units; 0: all.
    edge : target edge length of the new triangles, world units.
    """
    edges = edges_of(mesh.faces)
    openings = find_openings(mesh, edges, largest, edge)
    progress.step("spanning holes", len(openings))
    normals = _boundary_normals(mesh, edges)
    inner = _inner_edges(edges, len(mesh.vertices))
    spans = []
    for span in map_ahead(
        lambda opening: _span_opening(mesh, opening, normals, inner, edge), openings
    ):
        if span is not None:
            spans.append(span)
        progress.advance()
    shares = _seen_through_shares(mesh, spans, scene, _BEHIND_EDGES * edge)
    kept = [s for s, share in zip(spans, shares.tolist(), strict=True) if share <= _MAX_THROUGH]
    return Guesses(_add_spans(mesh, kept), len(kept), len(spans) - len(kept))


def _boundary_normals(mesh: Mesh, edges: Edges) -> dict[tuple[int, int], Floats]:
    """Return the unit normal of the face at each boundary edge, keyed by (start, stop)."""
    face, corner = np.nonzero((edges.count == 1)[edges.of_face])
    start, stop = mesh.faces[face, corner], mesh.faces[face, (corner + 1) % 3]
    pairs = zip(start.tolist(), stop.tolist(), strict=True)
    return dict(zip(pairs, Mesh(mesh.vertices, mesh.faces[face]).normals, strict=True))


def _inner_edges(edges: Edges, count: int) -> NDArray[np.int32]:
    """Return the (E, 2) interior edges that join two boundary vertices."""
    at_boundary = np.zeros(count, dtype=np.bool_)
    at_boundary[edges.pairs[edges.count == 1]] = True
    return edges.pairs[(edges.count > 1) & at_boundary[edges.pairs].all(axis=1)]


def _span_opening(
    mesh: Mesh,
    opening: Opening,
    normals: dict[tuple[int, int], Floats],
    inner: NDArray[np.int32],
    edge: float,
) -> _Span | None:
    """Return a span that continues the surface around an opening, or None."""
    rim = opening.rim
    points = np.concatenate([mesh.vertices[rim], opening.mouth])
    if len(points) > _MAX_RIM:
        return None
    outer, own = _rim_normals(rim, len(points), normals)
    barred = _find_barred(rim, points, inner, _SAME_PLACE * edge)
    if barred[np.arange(len(points)), np.arange(1, len(points) + 1) % len(points)].any():
        return None  # a bay whose mouth is already an edge of the mesh
    found = membrane(points, outer, barred, edge)
    if found is None:
        return None
    span = _Span(rim, np.concatenate([opening.mouth, found[0]]), found[1])
    patch = Mesh(np.concatenate([points, found[0]]), span.faces)
    if degenerate(patch, _MIN_FLATNESS).any():
        return None
    agrees = _rim_agreement(patch, points, outer, own) >= opening.min_cosine
    return span if agrees else None


def _rim_normals(
    rim: Ints, count: int, normals: dict[tuple[int, int], Floats]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the unit normals of the mesh at the edges from each rim point to the next.

    Returns
    -------
    (count, 3) unit normals; along a bay's mouth, the mean of the normals at the mouth's ends.
    (count,) bool, whether the edge belongs to a face of the mesh.
    """
    around = zip(rim.tolist(), np.roll(rim, -1).tolist(), strict=True)
    faces = [normals.get(pair) for pair in around]
    own = np.zeros(count, dtype=np.bool_)
    own[: len(rim)] = [normal is not None for normal in faces]
    of_faces = np.array([normal for normal in faces if normal is not None])
    beyond = of_faces[0] + of_faces[-1]
    outer = np.tile(beyond / max(float(np.linalg.norm(beyond)), 1e-30), (count, 1))
    outer[own] = of_faces
    return outer, own


def _find_barred(
    rim: Ints, points: Floats, inner: NDArray[np.int32], apart: float
) -> NDArray[np.bool_]:
    """Return the (n, n) pairs of points that coincide or already share an edge of the mesh.

    Parameters
    ----------
    rim : vertices of the first points.
    apart : distance below which two points coincide, world units.
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


def _rim_agreement(patch: Mesh, points: Floats, outer: Floats, own: NDArray[np.bool_]) -> float:
    """Return the mean cosine along the rim between the span's faces and the mesh's faces.

    Parameters
    ----------
    patch : the span; its first vertices are the rim's.
    points, outer : see `triangulate_rim`.
    own : (n,) whether the edge from a point to the next belongs to a face of the mesh.
    """
    n = len(points)
    after = np.roll(patch.faces, -1, axis=1)
    face, corner = np.nonzero((patch.faces < n) & (after == (patch.faces - 1) % n))
    mine = after[face, corner]  # start of the rim edge
    length = np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1)[mine] * own[mine]
    cosine = (patch.normals[face] * outer[mine]).sum(axis=1)
    return float((cosine * length).sum() / max(float(length.sum()), 1e-30))


def _add_spans(mesh: Mesh, spans: list[_Span]) -> Mesh:
    """Return the mesh with all spans added; the mesh itself if the list is empty."""
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


def _seen_through_shares(
    mesh: Mesh, spans: list[_Span], scene: Scene, min_distance: float
) -> Floats:
    """Return the share of each span that photos look through (see `share_seen_through`)."""
    joined = _add_spans(mesh, spans)
    alone = Mesh(joined.vertices, joined.faces[~joined.measured])
    span = np.repeat(np.arange(len(spans)), [len(item.faces) for item in spans])
    slack = [
        max(
            min_distance,
            _BEHIND_SHARE * float(np.linalg.norm(np.ptp(mesh.vertices[item.rim], axis=0))),
        )
        for item in spans
    ]
    return share_seen_through(mesh, alone, span, scene, np.array(slack))


# Approximate number of faces sampled per span.
_SAMPLES = 64


def share_seen_through(
    measured: Mesh, spans: Mesh, span: Ints, scene: Scene, tolerance: Floats
) -> Floats:
    """Return the share of sight lines to each span that pass through it.

    A sight line passes through a span if the photo shows the measured surface, or a sparse point,
    behind the span.

    Parameters
    ----------
    measured : the mesh with its holes.
    spans : all spans as one mesh, same frame.
    span : (F,) span number of each face of `spans`, ascending.
    tolerance : (S,) per span; a surface less than this behind the span lies on it, world units.

    Returns
    -------
    (S,) share of the sight lines of all photos; 0 for spans that no photo sees.
    """
    count = len(tolerance)
    seen, through = np.zeros(count), np.zeros(count)
    if count == 0:
        return seen
    sample = _sample_faces(span, count)
    surface, closed = Bvh(measured.vertices, measured.faces), Bvh(spans.vertices, spans.faces)
    for k, view in enumerate(scene.views):
        targets, number = spans.centroids[sample], span[sample]
        framed = _points_in_frame(view, targets)
        targets, number = targets[framed], number[framed]
        if len(targets) == 0:
            continue
        behind = _distance_behind(surface, view.centre, targets)
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


def _sample_faces(span: Ints, count: int) -> Ints:
    """Return evenly spaced faces of every span, at most twice `_SAMPLES` per span."""
    size = np.bincount(span, minlength=count)
    first = np.concatenate([[0], np.cumsum(size)])[:-1]
    step = np.maximum(size // _SAMPLES, 1)
    rank = np.arange(len(span)) - first[span]
    return np.flatnonzero(rank % step[span] == 0)


def _points_in_frame(view: View, points: Floats) -> NDArray[np.bool_]:
    """Return (n,) whether points lie inside a photo's frame."""
    pixels = np.nan_to_num(view.project(points), nan=-1.0)
    size = (view.camera.width, view.camera.height)
    return np.asarray(((pixels >= 0) & (pixels < size)).all(axis=1))


def _distance_behind(surface: Bvh, centre: Floats, targets: Floats) -> Floats:
    """Return (n,) how far behind each target its sight line meets the surface.

    Negative in front of the target; inf if the sight line misses the surface.
    """
    rays = targets - centre
    _, t = surface.first_hit(np.broadcast_to(centre, rays.shape), rays)
    return np.asarray((t - 1.0) * np.linalg.norm(rays, axis=1))
