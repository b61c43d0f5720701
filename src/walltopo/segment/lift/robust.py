"""The robust method: the evidence of the published method, with other decisions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instances, Mesh, Progress, View
from walltopo.geometry.graphs import louvain, renumber
from walltopo.geometry.topology import face_neighbours, patches
from walltopo.segment.lift.blocks import blocks_of
from walltopo.segment.lift.evidence import Evidence, Sampling, gather_evidence
from walltopo.segment.lift.records import scored_instances
from walltopo.segment.lift.settings import LiftParams
from walltopo.segment.lift.similarity import Covisible, compare_projections
from walltopo.segment.lift.vote import Claims, claims_of, potts_clusters, tidy_order, vote

Ints = NDArray[np.int32]

Floats = NDArray[np.float64]

# Two masks are compared only if the view of one saw at least this share of the other.
MIN_COMPARED_SHARE = 0.3

# Two masks are connected only if their IoU is at least this.
MIN_EDGE_IOU = 0.1

# A mask joins the instance with which its IoU is greatest, if that is at least this.
MIN_MATCH_IOU = 0.25


def _cluster_projections(
    pairs: Covisible, label: Ints, usable: NDArray[np.bool_], params: LiftParams
) -> Ints:
    """Return the (P,) cluster of each projection, -1 for those that are not usable.

    Parameters
    ----------
    label : (P,) int32, class of each projection.
    """
    count = len(usable)
    if params.overlap == "covisible":
        weight = pairs.iou
        edge = (pairs.p_seen >= MIN_COMPARED_SHARE * pairs.area[pairs.p]) | (
            pairs.q_seen >= MIN_COMPARED_SHARE * pairs.area[pairs.q]
        )
    else:
        weight = pairs.iou_of_all
        edge = np.ones(len(weight), dtype=np.bool_)
    edge &= (pairs.p < pairs.q) & (weight >= MIN_EDGE_IOU)
    if params.by_class:
        edge &= label[pairs.p] == label[pairs.q]
    edge &= usable[pairs.p] & usable[pairs.q]
    graph = pairs.p[edge], pairs.q[edge], weight[edge]
    if params.objective == "modularity":
        found = louvain(count, *graph, params.resolution, params.seed)
    else:
        found = potts_clusters(count, *graph, params.cohesion)
    cluster = np.where(usable, found, -1)
    cluster[usable] = renumber(cluster[usable].astype(np.int64))
    return cluster.astype(np.int32)


def _reassign_projections(
    evidence: Evidence, claims: Claims, area: Floats, usable: NDArray[np.bool_]
) -> Ints:
    """Return the cluster that each usable projection fits best, over what its view saw."""
    iou = claims.shared / (area[claims.projection] + claims.seen - claims.shared)
    good = (iou >= MIN_MATCH_IOU) & usable[claims.projection]
    cluster = np.full(len(usable), -1, dtype=np.int32)
    # NumPy keeps the last write: sort by ascending IoU, and the lower cluster last if equal.
    order = np.lexsort((-claims.cluster[good], iou[good]))
    cluster[claims.projection[good][order]] = claims.cluster[good][order]
    return cluster


def robust_evidence(
    mesh: Mesh, views: Sequence[View], params: LiftParams, progress: Progress
) -> Evidence:
    """Return the views' evidence, with soft borders and several samples per triangle."""
    sampling = Sampling(
        params.visibility_distance,
        params.easing_power,
        params.mask_resolution,
        params.border_band,
        params.sample_px,
        params.max_splits,
    )

    def drawing(view: View) -> list[int]:
        return tidy_order(view, params.on_top, params.drop_duplicates)

    return gather_evidence(blocks_of(mesh), views, drawing, sampling, progress)


def lift_robust(
    mesh: Mesh, views: Sequence[View], params: LiftParams, progress: Progress
) -> Instances:
    """Return the instances, with safeguards against wrong masks.

    Parameters
    ----------
    params : lengths in the mesh's unit (the caller resolves `normalised`).
    """
    evidence = robust_evidence(mesh, views, params, progress)
    progress.step("compare masks")
    return robust_instances(mesh, evidence, compare_projections(evidence), params, progress)


def robust_instances(
    mesh: Mesh, evidence: Evidence, pairs: Covisible, params: LiftParams, progress: Progress
) -> Instances:
    """Return the instances from gathered evidence: the steps that tuning repeats.

    Parameters
    ----------
    evidence, pairs : results of `robust_evidence` and `compare_projections`.
    """
    usable = pairs.area > 0
    progress.step("cluster")
    cluster = _cluster_projections(pairs, evidence.label, usable, params)
    progress.step("vote")
    winner, shares = vote(evidence, cluster, params)
    for _ in range(params.rounds):
        claims = claims_of(evidence, pairs, winner, int(cluster.max(initial=-1)) + 1)
        cluster = _reassign_projections(evidence, claims, pairs.area, usable)
        cluster[cluster >= 0] = renumber(cluster[cluster >= 0].astype(np.int64))
        winner, shares = vote(evidence, cluster, params)
    if params.fill_pinholes:
        neighbours = face_neighbours(mesh.faces[evidence.faces])
        winner = fill_pinholes(neighbours, evidence.areas, winner)
    return scored_instances(mesh, evidence, cluster, winner, shares, pairs, params)


# A hole is filled if its area is at most this share of the instance around it.
MAX_PINHOLE_SHARE = 0.05


def fill_pinholes(neighbours: Ints, areas: Floats, winner: Ints) -> Ints:
    """Assign each small hole that one cluster encloses to that cluster.

    A hole is a region of faces under some mask that no cluster keeps. A region at the border of
    the mesh, or of the faces under masks, is not a hole.

    Returns
    -------
    (C,) int32, `winner` with the holes filled.
    """
    inverse, regions = patches(neighbours, winner)
    size = np.bincount(inverse, areas, minlength=len(regions))
    around = np.where(neighbours >= 0, winner[neighbours], -2)
    own = winner[:, None]
    # Per region: the lowest and highest label across its border; -2 at the border of the mesh.
    across = around != own
    low = np.full(len(regions), np.iinfo(np.int32).max, dtype=np.int64)
    high = np.full(len(regions), -3, dtype=np.int64)
    region = np.broadcast_to(inverse[:, None], across.shape)
    np.minimum.at(low, region[across], around[across])
    np.maximum.at(high, region[across], around[across])
    total = np.bincount(np.maximum(winner, 0), np.where(winner >= 0, areas, 0.0))
    hole = (winner[regions] < 0) & (low == high) & (high >= 0)
    hole[hole] &= size[hole] <= MAX_PINHOLE_SHARE * total[high[hole]]
    return np.where(hole[inverse], high[inverse], winner).astype(np.int32)
