"""The published lift over sparse evidence, in kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instances, Mesh, Progress, Silent, View
from walltopo.graphs.components import renumber
from walltopo.graphs.louvain import Partition, louvain
from walltopo.lifting.blocks import blocks_of
from walltopo.lifting.contract import LiftParams
from walltopo.lifting.evidence import Evidence, Sampling, gather_evidence
from walltopo.lifting.labels import drawing_order
from walltopo.lifting.merge import (
    Kept,
    keep_faces,
    literal_instances,
    one_each,
    projection_scores,
)
from walltopo.lifting.overlap import overlaps_of

__all__ = ["lift_literal", "literal_clusters", "literal_graph", "literal_kept", "nothing"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def nothing(faces: int) -> Instances:
    """No instance at all: what a lift without views or masks gives."""
    return Instances(np.zeros(faces, dtype=np.int32), np.zeros(faces, dtype=np.float32), ())


def literal_graph(evidence: Evidence) -> tuple[Ints, Ints, Floats]:
    """Edges between projections of one class, weight = IoU of areas times both mean scores."""
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
    """(P,) cluster of each projection, class by class, numbered by first member.

    `graph` is that of `literal_graph`, where it is known already.
    """
    first, second, weight = literal_graph(evidence) if graph is None else graph
    count = len(evidence.label)
    # A mask on no triangle is a cluster of its own, and is kept from Louvain: vertices without
    # edges change the order in which it visits the others, and so which optimum it settles in.
    clusters = np.arange(count, 2 * count, dtype=np.int64)
    sizes = np.bincount(evidence.projection[evidence.projection >= 0], minlength=count)
    used = 0
    for label in np.unique(evidence.label):
        members = np.flatnonzero((evidence.label == label) & (sizes > 0))
        number = np.full(len(evidence.label), -1, dtype=np.int32)
        number[members] = np.arange(len(members), dtype=np.int32)
        mine = evidence.label[first] == label
        found = partition(
            len(members), number[first[mine]], number[second[mine]], weight[mine],
            params.resolution, params.seed,
        )  # fmt: skip
        clusters[members] = used + found
        used += len(members)
    return renumber(clusters)


def literal_kept(
    mesh: Mesh,
    views: Sequence[View],
    params: LiftParams,
    progress: Progress | None = None,
    partition: Partition = louvain,
) -> tuple[Evidence, Ints, Kept]:
    """What the published algorithm returns: clusters of projections, and the faces each keeps.

    Parameters
    ----------
    params : lengths in the mesh's unit (`normalised` is resolved by the caller).
    partition : how the graph is divided; for the comparison with the reference.

    Returns
    -------
    The evidence; (P,) int32, the cluster of each projection; the faces, which clusters of
    different classes may share.
    """
    progress = progress or Silent()
    if len(mesh.faces) == 0:
        raise InputError("the mesh has no triangles", "Is it a point cloud?")
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
    """The published algorithm, fast, with one instance a face: equal to `lift_reference`.

    See `literal_kept` for the parameters.
    """
    if not any(mask.area for view in views for mask in view.masks):
        return nothing(len(mesh.faces))
    evidence, cluster, kept = literal_kept(mesh, views, params, progress, partition)
    winner, shares = one_each(kept, len(evidence.faces))
    return literal_instances(evidence, cluster, winner, shares, len(mesh.faces), params.confidence)
