"""The robust method: the same evidence as the published one, other decisions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instances, Mesh, Progress, View
from walltopo.geometry.graphs import louvain, renumber
from walltopo.geometry.neighbours import face_neighbours, patches
from walltopo.segment.lift.blocks import blocks_of
from walltopo.segment.lift.evidence import Evidence, Sampling, gather_evidence
from walltopo.segment.lift.potts import potts_clusters
from walltopo.segment.lift.records import scored_instances
from walltopo.segment.lift.settings import LiftParams
from walltopo.segment.lift.similarity import Covisible, compare_projections
from walltopo.segment.lift.tidy import tidy_order
from walltopo.segment.lift.vote import Claims, claims_of, vote

Ints = NDArray[np.int32]

Floats = NDArray[np.float64]

# Two masks are compared if either's view saw this share of the other.
JUDGES = 0.3

# Masks that overlap less are not connected.
TOUCHES = 0.1

# A mask belongs to the instance that it overlaps most, at least this much.
FITS = 0.25


def _cluster(pairs: Covisible, label: Ints, usable: NDArray[np.bool_], params: LiftParams) -> Ints:
    """(P,) cluster of each projection, -1 for those that are not usable.

    Parameters
    ----------
    label : (P,) int32, class of each projection.
    """
    count = len(usable)
    if params.overlap == "covisible":
        weight = pairs.iou
        edge = (pairs.p_seen >= JUDGES * pairs.area[pairs.p]) | (
            pairs.q_seen >= JUDGES * pairs.area[pairs.q]
        )
    else:
        weight = pairs.iou_of_all
        edge = np.ones(len(weight), dtype=np.bool_)
    edge &= (pairs.p < pairs.q) & (weight >= TOUCHES)
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


def _reassign(evidence: Evidence, claims: Claims, area: Floats, usable: NDArray[np.bool_]) -> Ints:
    """Each usable projection to the cluster it agrees with best, over what its view saw."""
    iou = claims.shared / (area[claims.projection] + claims.seen - claims.shared)
    good = (iou >= FITS) & usable[claims.projection]
    cluster = np.full(len(usable), -1, dtype=np.int32)
    # The last write wins: ascending overlap, and the lower cluster last among equals.
    order = np.lexsort((-claims.cluster[good], iou[good]))
    cluster[claims.projection[good][order]] = claims.cluster[good][order]
    return cluster


def robust_evidence(
    mesh: Mesh, views: Sequence[View], params: LiftParams, progress: Progress
) -> Evidence:
    """What the views say, with soft borders and several samples a triangle."""
    sampling = Sampling(
        params.visibility_distance, params.easing_power, params.mask_resolution,
        params.border_band, params.sample_px, params.most_splits,
    )  # fmt: skip

    def drawing(view: View) -> list[int]:
        return tidy_order(view, params.on_top, params.drop_duplicates)

    return gather_evidence(blocks_of(mesh), views, drawing, sampling, progress)


def lift_robust(
    mesh: Mesh, views: Sequence[View], params: LiftParams, progress: Progress
) -> Instances:
    """Masks to instances, with defences against masks that are wrong.

    Parameters
    ----------
    params : lengths in the mesh's unit (`normalised` is resolved by the caller).
    """
    evidence = robust_evidence(mesh, views, params, progress)
    progress.step("compare masks")
    return robust_instances(mesh, evidence, compare_projections(evidence), params, progress)


def robust_instances(
    mesh: Mesh, evidence: Evidence, pairs: Covisible, params: LiftParams, progress: Progress
) -> Instances:
    """All that follows the look at the scene: what tuning repeats for other settings.

    Parameters
    ----------
    evidence, pairs : of `robust_evidence` and `compare_projections`.
    """
    usable = pairs.area > 0
    progress.step("cluster")
    cluster = _cluster(pairs, evidence.label, usable, params)
    progress.step("vote")
    winner, shares = vote(evidence, cluster, params)
    for _ in range(params.rounds):
        claims = claims_of(evidence, pairs, winner, int(cluster.max(initial=-1)) + 1)
        cluster = _reassign(evidence, claims, pairs.area, usable)
        cluster[cluster >= 0] = renumber(cluster[cluster >= 0].astype(np.int64))
        winner, shares = vote(evidence, cluster, params)
    if params.fill_pinholes:
        neighbours = face_neighbours(mesh.faces[evidence.faces])
        winner = fill_pinholes(neighbours, evidence.areas, winner)
    return scored_instances(mesh, evidence, cluster, winner, shares, pairs, params)


# A hole this small, against the instance around it, is filled.
PINHOLE = 0.05


def fill_pinholes(neighbours: Ints, areas: Floats, winner: Ints) -> Ints:
    """Give small holes that one cluster encloses to it.

    Holes are regions of faces that some mask lies on but no cluster keeps; where the mesh, or
    what any mask ever touched, ends there, it is no hole.

    Returns
    -------
    (C,) int32, `winner` with the holes filled.
    """
    inverse, regions = patches(neighbours, winner)
    size = np.bincount(inverse, areas, minlength=len(regions))
    around = np.where(neighbours >= 0, winner[neighbours], -2)
    own = winner[:, None]
    # Of every region: the lowest and highest label across its border; -2 where the mesh ends.
    across = around != own
    low = np.full(len(regions), np.iinfo(np.int32).max, dtype=np.int64)
    high = np.full(len(regions), -3, dtype=np.int64)
    region = np.broadcast_to(inverse[:, None], across.shape)
    np.minimum.at(low, region[across], around[across])
    np.maximum.at(high, region[across], around[across])
    total = np.bincount(np.maximum(winner, 0), np.where(winner >= 0, areas, 0.0))
    hole = (winner[regions] < 0) & (low == high) & (high >= 0)
    hole[hole] &= size[hole] <= PINHOLE * total[high[hole]]
    return np.where(hole[inverse], high[inverse], winner).astype(np.int32)
