"""The robust method: the same evidence as the published one, other decisions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instances, Mesh, Progress, View
from walltopo.graphs.components import renumber
from walltopo.graphs.louvain import louvain
from walltopo.lifting.blocks import blocks_of
from walltopo.lifting.contract import LiftParams
from walltopo.lifting.covisible import Covisible, compare_projections
from walltopo.lifting.evidence import Evidence, Sampling, gather_evidence
from walltopo.lifting.potts import potts_clusters
from walltopo.lifting.records import scored_instances
from walltopo.lifting.regions import fill_pinholes
from walltopo.lifting.tidy import tidy_order
from walltopo.lifting.vote import Claims, claims_of, vote
from walltopo.meshes.neighbours import face_neighbours

__all__ = ["find_fused", "lift_robust", "robust_evidence", "robust_instances"]

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]

# A view judges a mask if it saw this share of it.
JUDGES = 0.3
# A part: this share of another view's mask lies within the judged one, and it makes up at least
# this share of it.
WITHIN, PART = 0.7, 0.15
# Masks that overlap less are not connected.
TOUCHES = 0.1
# A mask belongs to the instance that it overlaps most, at least this much.
FITS = 0.25
# One mask over this share of the judged one confirms it.
WHOLE = 0.75


def find_fused(evidence: Evidence, pairs: Covisible) -> NDArray[np.bool_]:
    """Masks that more views see as several objects than as one.

    For a mask p, every other view that saw enough of it is asked for its masks on p's triangles:
    two or more, each mostly within p, say "several"; one that covers most of p says "one".

    Returns
    -------
    (P,) bool.
    """
    count, views = len(evidence.label), len(evidence.first_mask) - 1
    other = evidence.view_of[pairs.q]
    judges = pairs.p_seen >= JUDGES * pairs.area[pairs.p]
    cover = pairs.shared / np.maximum(pairs.p_seen, 1e-300)
    within = pairs.shared / np.maximum(pairs.q_seen, 1e-300)
    part = judges & (cover >= PART) & (within >= WITHIN)
    whole = judges & (cover >= WHOLE)
    key = pairs.p.astype(np.int64) * views + other
    asked, inverse = np.unique(key, return_inverse=True)
    parts = np.bincount(inverse, part, minlength=len(asked))
    wholes = np.bincount(inverse, whole, minlength=len(asked))
    several = parts >= 2
    one = ~several & (wholes >= 1)
    p = asked // views
    against = np.bincount(p[several], minlength=count)
    for_it = np.bincount(p[one], minlength=count)
    return against > for_it


def _cluster(pairs: Covisible, usable: NDArray[np.bool_], params: LiftParams) -> Ints:
    """(P,) cluster of each projection, -1 for those that are not usable."""
    count = len(usable)
    covered = (pairs.p_seen >= JUDGES * pairs.area[pairs.p]) | (
        pairs.q_seen >= JUDGES * pairs.area[pairs.q]
    )
    weight = pairs.iou
    edge = (pairs.p < pairs.q) & covered & (weight >= TOUCHES)
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
    """What the views say, with small masks on top, soft borders and several samples a triangle."""
    sampling = Sampling(
        params.visibility_distance, params.easing_power, params.mask_resolution,
        params.border_band, params.sample_px, params.most_splits,
    )  # fmt: skip
    return gather_evidence(
        blocks_of(mesh), views, lambda view: tidy_order(view, params.drop_duplicates), sampling,
        progress,
    )  # fmt: skip


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
    if params.drop_fused:
        usable &= ~find_fused(evidence, pairs)
    progress.step("cluster")
    cluster = _cluster(pairs, usable, params)
    progress.step("vote")
    winner, shares = vote(evidence, cluster, params.threshold, params.border_band)
    for _ in range(params.rounds):
        claims = claims_of(evidence, pairs, winner, int(cluster.max(initial=-1)) + 1)
        cluster = _reassign(evidence, claims, pairs.area, usable)
        cluster[cluster >= 0] = renumber(cluster[cluster >= 0].astype(np.int64))
        winner, shares = vote(evidence, cluster, params.threshold, params.border_band)
    if params.fill_pinholes:
        neighbours = face_neighbours(mesh.faces[evidence.faces])
        winner = fill_pinholes(neighbours, evidence.areas, winner)
    return scored_instances(mesh, evidence, cluster, winner, shares, pairs, params)
