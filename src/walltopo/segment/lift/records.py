"""Build instances from labelled faces: score, class and the masks that support each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instance, Instances, Mesh
from walltopo.segment.lift.evidence import Evidence
from walltopo.segment.lift.settings import LiftParams
from walltopo.segment.lift.similarity import Covisible
from walltopo.segment.lift.vote import Claims, claims_of

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]

# A view is expected to have a mask of an instance if it saw at least this share of it.
MIN_SEEN_SHARE = 0.5


def scored_instances(
    mesh: Mesh,
    evidence: Evidence,
    cluster: Ints,
    winner: Ints,
    shares: NDArray[np.float32],
    pairs: Covisible,
    params: LiftParams,
) -> Instances:
    """Return the numbered and scored instances; drop those with too little support.

    Parameters
    ----------
    cluster, winner : (P,) cluster of each projection and (C,) cluster of each face, -1 = none.
    shares : (C,) agreement on each face; pairs : the comparison of the projections.
    """
    count = int(max(cluster.max(initial=-1), winner.max(initial=-1))) + 1
    claims = claims_of(evidence, pairs, winner, count)
    scores = _cluster_scores(evidence, claims, cluster, pairs.area, params.min_support)
    kept = np.flatnonzero((scores > 0) & (claims.area > 0))
    number = np.zeros(count + 1, dtype=np.int32)  # the last entry serves cluster -1
    number[kept] = np.arange(1, len(kept) + 1)
    face_instance = np.zeros(len(mesh.faces), dtype=np.int32)
    face_score = np.zeros(len(mesh.faces), dtype=np.float32)
    face_instance[evidence.faces] = number[winner]
    face_score[evidence.faces] = np.where(number[winner] > 0, shares, 0.0)
    members = [np.flatnonzero(cluster == c) for c in kept]
    records = tuple(
        _voted_record(evidence, k, mine, float(scores[c]))
        for k, (c, mine) in enumerate(zip(kept, members, strict=True), start=1)
    )
    return Instances(face_instance, face_score, records)


def _cluster_scores(
    evidence: Evidence, claims: Claims, cluster: Ints, area: Floats, min_support: float
) -> Floats:
    """Return (K,) support x mean mask score x mean agreement of each cluster; 0 = drop it.

    Support is hits / (expected + 1). Hits are the views with a mask of the instance; expected
    views also include those that saw at least half of it. The 1 is a prior of one view without a
    mask. Agreement is the IoU of each mask with the instance over what the mask's view saw.
    """
    count = len(claims.area)
    own = cluster[claims.projection] == claims.cluster
    p, c = claims.projection[own], claims.cluster[own]
    iou = claims.shared[own] / (area[p] + claims.seen[own] - claims.shared[own])
    votes = np.maximum(np.bincount(c, minlength=count), 1)
    agreement = np.bincount(c, iou, minlength=count) / votes
    mask_score = np.bincount(c, evidence.score[p], minlength=count) / votes
    found = np.zeros(claims.visible.shape, dtype=np.bool_)
    found[c, evidence.view_of[p]] = True
    visible_area = np.maximum(claims.area, 1e-300)[:, None]
    expected = found | (claims.visible >= MIN_SEEN_SHARE * visible_area)
    hits, expected_views = found.sum(axis=1), expected.sum(axis=1)
    enough = hits >= min_support * expected_views
    return np.where(enough, hits / (expected_views + 1.0) * mask_score * agreement, 0.0)


def _voted_record(
    evidence: Evidence, number: int, members: NDArray[np.int64], score: float
) -> Instance:
    """Return a record whose class is voted by all masks, each with the weight of its score."""
    labels, inverse = np.unique(evidence.label[members], return_inverse=True)
    weight = np.bincount(inverse, evidence.score[members], minlength=len(labels))
    votes = {int(k): float(w) for k, w in zip(labels, weight / weight.sum(), strict=True)}
    view_of = evidence.view_of
    pairs = tuple((int(view_of[p]), int(p - evidence.first_mask[view_of[p]])) for p in members)
    return Instance(number, max(votes, key=lambda k: votes[k]), min(score, 1.0), pairs, votes)
