"""The published lift, slow and plain: the oracle of the tests.

The publication's Algorithms 3 to 7, each step with loops, sets and dictionaries, NumPy and ray
casting by trimesh. It shares no kernel with the fast one; only the drawing of label images, the
easing and the settings are common. The caller says who clusters: the tests hand both methods
networkx. docs/publication.md tells where the text leaves a choice, or contradicts itself, and what
is done here.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instance, Instances, Mesh, View
from walltopo.geometry.graphs import Partition
from walltopo.segment.lift.distance import ease
from walltopo.segment.lift.fast import TIE, confidence_of
from walltopo.segment.lift.label_image import draw_labels, drawing_order
from walltopo.segment.lift.settings import Confidence, LiftParams

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# A ray "hits the triangle itself" also where it meets another one within this share of the
# distance: duplicates of a triangle are seen together, and Embree's rays are float32.
NEARER = 1e-5
# Cells of the spatial hash along the visibility distance; their size changes no result.
CELLS = 80


@dataclass
class Projection:
    """One mask on the mesh: its triangles with a score each (`p.triangle_scores`)."""

    view: int
    mask: int
    label: int
    triangles: dict[int, float] = field(default_factory=dict[int, float])

    @cached_property
    def score(self) -> float:
        """Mean of the scores of its triangles; asked for when all of them are there."""
        return float(np.mean(list(self.triangles.values())))


def project_view(
    number: int, view: View, mesh: Mesh, params: LiftParams, tracer: object
) -> tuple[list[Projection], dict[int, float]]:
    """Steps 1: the projections of one view, and its negative evidence (triangle to d).

    Parameters
    ----------
    tracer : trimesh's ray caster of the mesh.
    """
    labels = draw_labels(view, drawing_order(view, params.on_top), params.mask_resolution)
    rays = mesh.centroids - view.centre
    distance = np.linalg.norm(rays, axis=1)
    near = (distance <= params.visibility_distance) & (rays @ view.direction > 0)
    pixels = np.full((len(rays), 2), -1.0)
    pixels[near] = view.project(mesh.centroids[near])
    camera = view.camera
    inside = near & (pixels >= 0).all(axis=1) & (mesh.areas > 0)
    inside &= (pixels[:, 0] < camera.width) & (pixels[:, 1] < camera.height)
    remaining = np.flatnonzero(inside & _before_fold(view, mesh.centroids))
    seen = remaining[_seen(tracer, view.centre, rays[remaining], distance[remaining], remaining)]
    weight = ease(distance[seen], params.visibility_distance, params.easing_power)
    height, width = labels.shape
    found: dict[int, Projection] = {}
    negative: dict[int, float] = {}
    for triangle, d in zip(seen.tolist(), weight.tolist(), strict=True):
        x, y = pixels[triangle]
        col = min(int(x * width / camera.width), width - 1)
        row = min(int(y * height / camera.height), height - 1)
        index = int(labels[row, col])
        if index < 0:
            negative[triangle] = d
            continue
        mask = view.masks[index]
        projection = found.setdefault(index, Projection(number, index, mask.label))
        projection.triangles[triangle] = mask.score * d
    return [found[index] for index in sorted(found)], negative


def _before_fold(view: View, points: Floats) -> NDArray[np.bool_]:
    """Points within the range where the camera's distortion model is one-to-one."""
    if view.camera.is_pinhole:
        return np.ones(len(points), dtype=np.bool_)
    from walltopo.geometry.screen import valid_slope

    local = view.to_camera(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.hypot(local[:, 0], local[:, 1]) / local[:, 2]
    return (local[:, 2] > 0) & (slope < valid_slope(view.camera))


def _seen(
    tracer: object, centre: Floats, rays: Floats, distance: Floats, targets: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Is the first hit of the ray to a triangle's centroid that triangle itself?"""
    seen = np.zeros(len(rays), dtype=np.bool_)
    if len(rays) == 0:
        return seen
    origins = np.broadcast_to(centre, rays.shape)
    places, ray, triangle = tracer.intersects_location(  # type: ignore[attr-defined]
        origins, rays, multiple_hits=False
    )
    reached = np.linalg.norm(places - centre, axis=1)
    itself = triangle == targets[ray]
    level = reached >= distance[ray] * (1 - NEARER)
    # A ray that meets nothing slipped between the edges of its own triangle by rounding.
    seen[:] = True
    seen[ray] = itself | level
    return seen


def _candidate_pairs(
    projections: list[Projection], mesh: Mesh, cell: float
) -> set[tuple[int, int]]:
    """Pairs that meet in a cell of the spatial hash of their triangles' centroids."""
    table: dict[tuple[int, ...], set[int]] = defaultdict(set)
    for number, projection in enumerate(projections):
        cells = np.floor(mesh.centroids[list(projection.triangles)] / cell).astype(np.int64)
        for key in {tuple(row) for row in cells.tolist()}:
            table[key].add(number)
    return {pair for members in table.values() for pair in combinations(sorted(members), 2)}


def projection_graph(
    projections: list[Projection], mesh: Mesh, cell: float
) -> list[tuple[int, int, float]]:
    """Step 2: edges (p, q, weight) between projections of one class, p < q, sorted."""
    edges = []
    for p, q in sorted(_candidate_pairs(projections, mesh, cell)):
        one, other = projections[p], projections[q]
        if one.label != other.label:
            continue
        both = sum(mesh.areas[t] for t in one.triangles if t in other.triangles)
        if both <= 0:
            continue
        either = sum(mesh.areas[list(one.triangles)]) + sum(mesh.areas[list(other.triangles)])
        edges.append((p, q, both / (either - both) * one.score * other.score))
    return edges


def _clusters(
    projections: list[Projection],
    edges: list[tuple[int, int, float]],
    params: LiftParams,
    partition: Partition,
) -> list[list[int]]:
    """Louvain in each class; clusters in the order of their first projection."""
    clusters = []
    for label in sorted({p.label for p in projections}):
        members = [k for k, p in enumerate(projections) if p.label == label]
        number = {k: n for n, k in enumerate(members)}
        mine = [(number[p], number[q], w) for p, q, w in edges if p in number and q in number]
        found = partition(
            len(members),
            np.array([e[0] for e in mine], dtype=np.int32),
            np.array([e[1] for e in mine], dtype=np.int32),
            np.array([e[2] for e in mine], dtype=np.float64),
            params.resolution,
            params.seed,
        )
        groups: dict[int, list[int]] = defaultdict(list)
        for k, cluster in zip(members, found.tolist(), strict=True):
            groups[cluster].append(k)
        clusters += list(groups.values())
    return sorted(clusters)


def lift_reference(
    mesh: Mesh, views: Sequence[View], params: LiftParams, partition: Partition
) -> Instances:
    """Masks to instances as published, with one instance a triangle; lengths in the mesh's unit.

    See `reference_kept` for the parameters.
    """
    projections, clusters, kept = reference_kept(mesh, views, params, partition)
    winner: dict[int, tuple[int, int]] = {}
    for number, shares in enumerate(kept):
        for triangle, share in shares.items():
            # The greatest share; of equals (`TIE`) the lowest number.
            rank = round(share / TIE), -number
            winner[triangle] = max(winner.get(triangle, rank), rank)
    faces = [[t for t in kept[k] if winner[t][1] == -k] for k in range(len(kept))]
    return _instances(mesh, projections, clusters, kept, faces, params.confidence)


def reference_kept(
    mesh: Mesh, views: Sequence[View], params: LiftParams, partition: Partition
) -> tuple[list[Projection], list[list[int]], list[dict[int, float]]]:
    """What the published algorithm returns: instances, which may overlap across classes.

    Parameters
    ----------
    partition : how the graph of projections is divided. Both the fast method and this one take
        it, so that a test can compare everything else exactly.

    Returns
    -------
    All projections; the clusters, as numbers of projections; and the triangles that each cluster
    keeps, with the share of positive evidence.
    """
    import trimesh

    tracer = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).ray
    projections: list[Projection] = []
    uncovered: dict[int, float] = defaultdict(float)
    for number, view in enumerate(views):
        found, negative = project_view(number, view, mesh, params, tracer)
        projections += found
        for triangle, d in negative.items():
            uncovered[triangle] += d
    edges = projection_graph(projections, mesh, params.visibility_distance / CELLS)
    clusters = _clusters(projections, edges, params, partition)
    return projections, clusters, _merge(projections, clusters, uncovered, params.threshold)


def _merge(
    projections: list[Projection],
    clusters: list[list[int]],
    uncovered: dict[int, float],
    threshold: float,
) -> list[dict[int, float]]:
    """Algorithm 7: the triangles that each cluster keeps, with their share."""
    others: dict[int, list[tuple[int, Projection]]] = defaultdict(list)
    for number, members in enumerate(clusters):
        for k in members:
            for triangle in projections[k].triangles:
                others[triangle].append((number, projections[k]))
    kept: list[dict[int, float]] = []
    for number, members in enumerate(clusters):
        label = projections[members[0]].label
        # Algorithm 5: the scores of the cluster's projections, each the mean of its triangles.
        positive: dict[int, float] = defaultdict(float)
        for k in members:
            for triangle in projections[k].triangles:
                positive[triangle] += projections[k].score
        kept.append({})
        for triangle, plus in positive.items():
            # Algorithm 6: views that see no object there, and what other clusters say.
            minus = uncovered.get(triangle, 0.0)
            for other, projection in others[triangle]:
                if other != number and projection.label == label:
                    minus += projection.triangles[triangle]
            if plus > 0 and plus >= (threshold - TIE) * (plus + minus):
                kept[-1][triangle] = plus / (plus + minus)
    return kept


def _instances(
    mesh: Mesh,
    projections: list[Projection],
    clusters: list[list[int]],
    kept: list[dict[int, float]],
    faces: list[list[int]],
    way: Confidence,
) -> Instances:
    """The instances, numbered as their clusters; those without a triangle of their own go."""
    face_instance = np.zeros(len(mesh.faces), dtype=np.int32)
    face_score = np.zeros(len(mesh.faces), dtype=np.float32)
    records: list[Instance] = []
    for number, mine in enumerate(faces):
        if not mine:
            continue
        members = [projections[k] for k in clusters[number]]
        shares = np.array([kept[number][triangle] for triangle in mine])
        scores = np.array([p.score for p in members])
        pairs = tuple((p.view, p.mask) for p in members)
        label = members[0].label
        sure = confidence_of(way, scores, shares, mesh.areas[mine])
        record = Instance(len(records) + 1, label, sure, pairs, {label: 1.0})
        face_instance[mine] = record.id
        face_score[mine] = shares
        records.append(record)
    return Instances(face_instance, face_score, tuple(records))
