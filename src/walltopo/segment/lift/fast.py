"""The published method, compiled: distance easing, merging and thresholds of projections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instance, Instances, Mesh, Progress, Silent, View
from walltopo.geometry.graphs import Partition, louvain, renumber
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.segment.lift.blocks import blocks_of
from walltopo.segment.lift.evidence import Evidence, Sampling, gather_evidence
from walltopo.segment.lift.label_image import drawing_order
from walltopo.segment.lift.settings import Confidence, LiftParams
from walltopo.segment.lift.similarity import overlaps_of

Floats = NDArray[np.float64]

Ints = NDArray[np.int32]


def no_instances(faces: int) -> Instances:
    """Return the result of a lift without views or masks: every face unlabelled."""
    return Instances(np.zeros(faces, dtype=np.int32), np.zeros(faces, dtype=np.float32), ())


def literal_graph(evidence: Evidence) -> tuple[Ints, Ints, Floats]:
    """Return edges between projections of a class: area IoU times both mean scores."""
    overlaps = overlaps_of(evidence)
    mean = projection_scores(evidence)
    p, q = overlaps.first, overlaps.second
    same = evidence.label[p] == evidence.label[q]
    p, q, shared = p[same], q[same], overlaps.shared[same]
    union = overlaps.area[p] + overlaps.area[q] - shared
    return p, q, shared / union * mean[p] * mean[q]


def literal_clusters(
    evidence: Evidence,
    params: LiftParams,
    partition: Partition,
    graph: tuple[Ints, Ints, Floats] | None = None,
) -> Ints:
    """Return the (P,) cluster of each projection, found per class, numbered by first member.

    `graph` is the result of `literal_graph`, if the caller has it already.
    """
    first, second, weight = literal_graph(evidence) if graph is None else graph
    count = len(evidence.label)
    # A mask on no triangle is a cluster of its own and is kept out of Louvain: vertices without
    # edges change the order in which Louvain visits the others, and so its local optimum.
    clusters = np.arange(count, 2 * count, dtype=np.int64)
    sizes = np.bincount(evidence.projection[evidence.projection >= 0], minlength=count)
    used = 0
    for label in np.unique(evidence.label):
        members = np.flatnonzero((evidence.label == label) & (sizes > 0))
        number = np.full(len(evidence.label), -1, dtype=np.int32)
        number[members] = np.arange(len(members), dtype=np.int32)
        mine = evidence.label[first] == label
        found = partition(
            len(members),
            number[first[mine]],
            number[second[mine]],
            weight[mine],
            params.resolution,
            params.seed,
        )
        clusters[members] = used + found
        used += len(members)
    return renumber(clusters)


def literal_kept(
    mesh: Mesh,
    views: Sequence[View],
    params: LiftParams,
    progress: Progress | None = None,
    partition: Partition = louvain,
) -> tuple[Evidence, Ints, KeptFaces]:
    """Return the clusters of projections and the faces that each keeps, as published.

    Parameters
    ----------
    params : lengths in the mesh's unit (the caller resolves `normalised`).
    partition : the graph clustering; a test passes the reference's.

    Returns
    -------
    The evidence; (P,) int32, the cluster of each projection; the kept faces, which clusters of
    different classes may share.
    """
    progress = progress or Silent()
    if len(mesh.faces) == 0:
        raise InputError("the mesh has no triangles", "Check that it is not a point cloud.")
    sampling = Sampling(params.visibility_distance, params.easing_power, params.mask_resolution)
    evidence = gather_evidence(
        blocks_of(mesh), views, lambda view: drawing_order(view, params.on_top), sampling, progress
    )
    progress.step("cluster projections")
    cluster = literal_clusters(evidence, params, partition)
    progress.step("merge")
    return evidence, cluster, keep_faces(evidence, cluster, params.threshold)


def lift_literal(
    mesh: Mesh,
    views: Sequence[View],
    params: LiftParams,
    progress: Progress | None = None,
    partition: Partition = louvain,
) -> Instances:
    """Return the instances of the published algorithm, one per face; equal to `lift_reference`.

    See `literal_kept` for the parameters.
    """
    if not any(mask.area for view in views for mask in view.masks):
        return no_instances(len(mesh.faces))
    evidence, cluster, kept = literal_kept(mesh, views, params, progress, partition)
    winner, shares = best_cluster(kept, len(evidence.faces))
    return literal_instances(evidence, cluster, winner, shares, len(mesh.faces), params.confidence)


# Shares within this tolerance of the threshold reach it, so that the order of summing floats has
# no influence.
TIE = 1e-6


@dataclass(frozen=True, eq=False)
class KeptFaces:
    """The faces that each cluster keeps; clusters of different classes may keep the same face.

    Parameters
    ----------
    face : (n,) int64, indices into `Evidence.faces`, ascending.
    cluster : (n,) int32, ascending within a face.
    share : (n,) float32, share of positive evidence.
    """

    face: NDArray[np.int64]
    cluster: Ints
    share: NDArray[np.float32]


def projection_scores(evidence: Evidence) -> Floats:
    """Return (P,) `p.score`: the mean of its triangles' scores; 0 for a projection without any."""
    positive = evidence.projection >= 0
    owner = evidence.projection[positive]
    scores = evidence.ease[positive].astype(np.float64) * evidence.score[owner]
    count = len(evidence.label)
    sizes = np.bincount(owner, minlength=count)
    return np.asarray(np.bincount(owner, scores, minlength=count) / np.maximum(sizes, 1))


def keep_faces(evidence: Evidence, cluster: Ints, threshold: float) -> KeptFaces:
    """Return every face with every cluster that keeps it (the publication's Algorithms 5 to 7).

    Parameters
    ----------
    cluster : (P,) int32, cluster of each projection.
    """
    common = (
        _keep,
        len(evidence.faces),
        evidence.starts,
        evidence.projection,
        evidence.ease.astype(np.float64),
        evidence.score,
        projection_scores(evidence),
        evidence.label,
        cluster,
        threshold,
    )
    places = np.zeros(len(evidence.starts), dtype=np.int64)
    counts = np.zeros(len(evidence.faces), dtype=np.int64)
    empty = np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.float32)
    in_ranges(*common, places, counts, *empty)
    np.cumsum(counts, out=places[1:])
    owner = np.zeros(places[-1], dtype=np.int32)
    share = np.zeros(places[-1], dtype=np.float32)
    counts[:] = 0
    in_ranges(*common, places, counts, owner, share)
    face = np.repeat(np.arange(len(places) - 1), np.diff(places))
    order = np.lexsort((owner, face))
    return KeptFaces(face, owner[order], share[order])


@kernel
def _keep(
    first_face: Any,
    end_face: Any,
    starts: Any,
    projection: Any,
    ease: Any,
    score: Any,
    mean: Any,
    label: Any,
    cluster: Any,
    threshold: Any,
    places: Any,
    counts: Any,
    owner: Any,
    share: Any,
) -> None:
    """Count the clusters that keep each face; if `owner` is not empty, store them in it."""
    for face in range(first_face, end_face):
        begin, end = starts[face], starts[face + 1]
        uncovered = 0.0
        for k in range(begin, end):
            if projection[k] < 0:
                uncovered += ease[k]
        for k in range(begin, end):
            p = projection[k]
            if p < 0:
                continue
            first = True
            positive, negative = 0.0, uncovered
            for j in range(begin, end):
                q = projection[j]
                if q < 0:
                    continue
                if cluster[q] == cluster[p]:
                    first = first and j >= k
                    positive += mean[q]
                elif label[q] == label[p]:
                    negative += ease[j] * score[q]
            total = positive + negative
            if first and positive > 0 and positive >= (threshold - TIE) * total:
                if len(owner):
                    owner[places[face] + counts[face]] = cluster[p]
                    share[places[face] + counts[face]] = positive / total
                counts[face] += 1


def best_cluster(kept: KeptFaces, count: int) -> tuple[Ints, NDArray[np.float32]]:
    """Return one cluster per face: the one with the greatest share, or lowest number if equal.

    This step is not in the publication, where instances of two classes may overlap. A labelled
    mesh has one label per triangle.

    Returns
    -------
    (count,) int32, the cluster of each face, -1 = none; and (count,) float32, its share.
    """
    winner = np.full(count, -1, dtype=np.int32)
    shares = np.zeros(count, dtype=np.float32)
    # Shares within `TIE` are equal. NumPy keeps the last write.
    order = np.lexsort((-kept.cluster, np.round(kept.share / TIE), kept.face))
    winner[kept.face[order]] = kept.cluster[order]
    shares[kept.face[order]] = kept.share[order]
    return winner, shares


def confidence_of(rule: Confidence, scores: Floats, shares: Floats, areas: Floats) -> float:
    """Return the confidence of an instance, in [0, 1].

    Parameters
    ----------
    scores : (n,) `p.score` of its projections. For "sum", a sum s gives s / (1 + s).
    shares, areas : (m,) share of positive evidence, and area, of its faces.
    """
    if rule == "share":
        return min(float(np.average(shares, weights=areas)), 1.0)
    total = float(scores.sum())
    return total / len(scores) if rule == "mean" else total / (1 + total)


def literal_instances(
    evidence: Evidence,
    cluster: Ints,
    winner: Ints,
    shares: NDArray[np.float32],
    faces: int,
    rule: Confidence,
) -> Instances:
    """Return the instances of the clusters that own a face, numbered in the order of clusters.

    Parameters
    ----------
    winner, shares : the result of `best_cluster`; faces : number of faces of the mesh.
    """
    face_instance = np.zeros(faces, dtype=np.int32)
    face_score = np.zeros(faces, dtype=np.float32)
    scores = projection_scores(evidence)
    view_of = evidence.view_of
    records = []
    for number, found in enumerate(np.unique(winner[winner >= 0]), start=1):
        mine = winner == found
        face_instance[evidence.faces[mine]] = number
        face_score[evidence.faces[mine]] = shares[mine]
        members = np.flatnonzero(cluster == found)
        label = int(evidence.label[members[0]])
        confidence = confidence_of(
            rule, scores[members], shares[mine].astype(np.float64), evidence.areas[mine]
        )
        views = tuple((int(view_of[p]), int(p - evidence.first_mask[view_of[p]])) for p in members)
        records.append(Instance(number, label, confidence, views, {label: 1.0}))
    return Instances(face_instance, face_score, tuple(records))
