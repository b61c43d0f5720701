"""The published lift, slow and plain: the oracle of the tests.

The publication's Algorithms 3 to 7 with loops, sets and dictionaries, NumPy and ray casting by
trimesh. This module shares no kernel with the fast one; only the drawing of label images, the
easing and the settings are common. The caller passes the clustering: the tests pass networkx to
both methods. docs/publication.md lists where the text is ambiguous or contradictory, and the
choice made here.
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
from walltopo.segment.lift.distance import distance_weight
from walltopo.segment.lift.fast import TIE, confidence_of
from walltopo.segment.lift.label_image import draw_labels, drawing_order
from walltopo.segment.lift.settings import Confidence, LiftParams

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# A ray that hits another triangle within this share of the distance counts as hitting its target:
# duplicates of a triangle are all visible, and Embree's rays are float32.
HIT_TOLERANCE = 1e-5
# Number of cells of the spatial hash per visibility distance. The cell size changes no result.
CELLS = 80


@dataclass
class Projection:
    """One mask projected onto the mesh: its triangles with their scores (`p.triangle_scores`)."""

    view: int
    mask: int
    label: int
    triangles: dict[int, float] = field(default_factory=dict[int, float])

    @cached_property
    def score(self) -> float:
        """Return the mean score of the triangles; read this only once all triangles are added."""
        return float(np.mean(list(self.triangles.values())))


def project_view(
    number: int, view: View, mesh: Mesh, params: LiftParams, tracer: object
) -> tuple[list[Projection], dict[int, float]]:
    """Return the projections of one view, and its negative evidence per triangle (step 1).

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
    seen = remaining[
        _visible_triangles(tracer, view.centre, rays[remaining], distance[remaining], remaining)
    ]
    weight = distance_weight(distance[seen], params.visibility_distance, params.easing_power)
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
    """Return which points lie where the camera's distortion model is one-to-one."""
    if view.camera.is_pinhole:
        return np.ones(len(points), dtype=np.bool_)
    from walltopo.geometry.screen import valid_slope

    local = view.to_camera(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.hypot(local[:, 0], local[:, 1]) / local[:, 2]
    return (local[:, 2] > 0) & (slope < valid_slope(view.camera))


def _visible_triangles(
    tracer: object, centre: Floats, rays: Floats, distance: Floats, targets: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return whether the ray to each triangle's centroid hits that triangle first."""
    seen = np.zeros(len(rays), dtype=np.bool_)
    if len(rays) == 0:
        return seen
    origins = np.broadcast_to(centre, rays.shape)
    places, ray, triangle = tracer.intersects_location(  # type: ignore[attr-defined]
        origins, rays, multiple_hits=False
    )
    hit_distance = np.linalg.norm(places - centre, axis=1)
    itself = triangle == targets[ray]
    level = hit_distance >= distance[ray] * (1 - HIT_TOLERANCE)
    # A ray without a hit slipped between the edges of its own triangle by rounding.
    seen[:] = True
    seen[ray] = itself | level
    return seen


def _candidate_pairs(
    projections: list[Projection], mesh: Mesh, cell: float
) -> set[tuple[int, int]]:
    """Return pairs of projections with a common cell in the spatial hash of triangle centroids."""
    table: dict[tuple[int, ...], set[int]] = defaultdict(set)
    for number, projection in enumerate(projections):
        cells = np.floor(mesh.centroids[list(projection.triangles)] / cell).astype(np.int64)
        for key in {tuple(row) for row in cells.tolist()}:
            table[key].add(number)
    return {pair for members in table.values() for pair in combinations(sorted(members), 2)}


def projection_graph(
    projections: list[Projection], mesh: Mesh, cell: float
) -> list[tuple[int, int, float]]:
    """Return edges (p, q, weight) between projections of one class, p < q, sorted (step 2)."""
    edges = []
    for p, q in sorted(_candidate_pairs(projections, mesh, cell)):
        one, other = projections[p], projections[q]
        if one.label != other.label:
            continue
        shared = sum(mesh.areas[t] for t in one.triangles if t in other.triangles)
        if shared <= 0:
            continue
        total = sum(mesh.areas[list(one.triangles)]) + sum(mesh.areas[list(other.triangles)])
        edges.append((p, q, shared / (total - shared) * one.score * other.score))
    return edges


def _cluster_projections(
    projections: list[Projection],
    edges: list[tuple[int, int, float]],
    params: LiftParams,
    partition: Partition,
) -> list[list[int]]:
    """Return the Louvain clusters of each class, in the order of their first projection."""
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
    """Return the instances of the published algorithm, one per triangle.

    Lengths in `params` are in the mesh's unit.

    See `reference_kept` for the parameters.
    """
    projections, clusters, kept = reference_kept(mesh, views, params, partition)
    winner: dict[int, tuple[int, int]] = {}
    for number, shares in enumerate(kept):
        for triangle, share in shares.items():
            # Shares within `TIE` are equal; then the lowest number wins.
            rank = round(share / TIE), -number
            winner[triangle] = max(winner.get(triangle, rank), rank)
    faces = [[t for t in kept[k] if winner[t][1] == -k] for k in range(len(kept))]
    return _number_instances(mesh, projections, clusters, kept, faces, params.confidence)


def reference_kept(
    mesh: Mesh, views: Sequence[View], params: LiftParams, partition: Partition
) -> tuple[list[Projection], list[list[int]], list[dict[int, float]]]:
    """Return the result of the published algorithm: instances that may overlap across classes.

    Parameters
    ----------
    partition : the clustering of the graph. Both this method and the fast one take it, so that a
        test can compare all other steps exactly.

    Returns
    -------
    All projections; the clusters, as lists of projection numbers; and per cluster the triangles
    that it keeps, with their share of positive evidence.
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
    clusters = _cluster_projections(projections, edges, params, partition)
    return (
        projections,
        clusters,
        _merge_clusters(projections, clusters, uncovered, params.threshold),
    )


def _merge_clusters(
    projections: list[Projection],
    clusters: list[list[int]],
    uncovered: dict[int, float],
    threshold: float,
) -> list[dict[int, float]]:
    """Return the triangles that each cluster keeps, with their share (Algorithm 7)."""
    by_triangle: dict[int, list[tuple[int, Projection]]] = defaultdict(list)
    for number, members in enumerate(clusters):
        for k in members:
            for triangle in projections[k].triangles:
                by_triangle[triangle].append((number, projections[k]))
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
            # Algorithm 6: views without a mask there, and masks of other clusters.
            minus = uncovered.get(triangle, 0.0)
            for other, projection in by_triangle[triangle]:
                if other != number and projection.label == label:
                    minus += projection.triangles[triangle]
            if plus > 0 and plus >= (threshold - TIE) * (plus + minus):
                kept[-1][triangle] = plus / (plus + minus)
    return kept


def _number_instances(
    mesh: Mesh,
    projections: list[Projection],
    clusters: list[list[int]],
    kept: list[dict[int, float]],
    faces: list[list[int]],
    rule: Confidence,
) -> Instances:
    """Return the instances, numbered as their clusters, without those that own no triangle."""
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
        confidence = confidence_of(rule, scores, shares, mesh.areas[mine])
        record = Instance(len(records) + 1, label, confidence, pairs, {label: 1.0})
        face_instance[mine] = record.id
        face_score[mine] = shares
        records.append(record)
    return Instances(face_instance, face_score, tuple(records))
