"""From labelled faces to instances with a score, a class and the masks that support them."""

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

# A view should have found an instance if it saw this share of it.
EXPECTED = 0.5


def scored_instances(
    mesh: Mesh,
    evidence: Evidence,
    cluster: Ints,
    winner: Ints,
    shares: NDArray[np.float32],
    pairs: Covisible,
    params: LiftParams,
) -> Instances:
    """Number, score and describe the instances; drop those with too little support.

    Parameters
    ----------
    cluster, winner : (P,) cluster of each projection and (C,) cluster of each face, -1 = none.
    shares : (C,) agreement on each face; pairs : the projections' comparison.
    """
    count = int(max(cluster.max(initial=-1), winner.max(initial=-1))) + 1
    claims = claims_of(evidence, pairs, winner, count)
    scores = _scores(evidence, claims, cluster, pairs.area, params.least_support)
    kept = np.flatnonzero((scores > 0) & (claims.area > 0))
    number = np.zeros(count + 1, dtype=np.int32)  # the last entry serves cluster -1
    number[kept] = np.arange(1, len(kept) + 1)
    face_instance = np.zeros(len(mesh.faces), dtype=np.int32)
    face_score = np.zeros(len(mesh.faces), dtype=np.float32)
    face_instance[evidence.faces] = number[winner]
    face_score[evidence.faces] = np.where(number[winner] > 0, shares, 0.0)
    members = [np.flatnonzero(cluster == c) for c in kept]
    records = tuple(
        _record(evidence, k, mine, float(scores[c]))
        for k, (c, mine) in enumerate(zip(kept, members, strict=True), start=1)
    )
    return Instances(face_instance, face_score, records)


def _scores(
    evidence: Evidence, claims: Claims, cluster: Ints, area: Floats, least_support: float
) -> Floats:
    """(K,) support x mean mask score x mean agreement of each cluster; 0 = to be dropped.

    Support is the share of the views that saw at least half of the instance and hold a mask of
    it, with one view of doubt; agreement is the overlap of each mask with the instance over what
    its view saw.
    """
    count = len(claims.area)
    own = cluster[claims.projection] == claims.cluster
    p, c = claims.projection[own], claims.cluster[own]
    iou = claims.shared[own] / (area[p] + claims.seen[own] - claims.shared[own])
    votes = np.maximum(np.bincount(c, minlength=count), 1)
    agreement = np.bincount(c, iou, minlength=count) / votes
    certainty = np.bincount(c, evidence.score[p], minlength=count) / votes
    found = np.zeros(claims.visible.shape, dtype=np.bool_)
    found[c, evidence.view_of[p]] = True
    expected = found | (claims.visible >= EXPECTED * np.maximum(claims.area, 1e-300)[:, None])
    hits, chances = found.sum(axis=1), expected.sum(axis=1)
    enough = hits >= least_support * chances
    return np.where(enough, hits / (chances + 1.0) * certainty * agreement, 0.0)


def _record(evidence: Evidence, number: int, members: NDArray[np.int64], score: float) -> Instance:
    """Class by the votes of all masks, whatever their class, each with its score."""
    labels, inverse = np.unique(evidence.label[members], return_inverse=True)
    weight = np.bincount(inverse, evidence.score[members], minlength=len(labels))
    votes = {int(k): float(w) for k, w in zip(labels, weight / weight.sum(), strict=True)}
    view_of = evidence.view_of
    pairs = tuple((int(view_of[p]), int(p - evidence.first_mask[view_of[p]])) for p in members)
    return Instance(number, max(votes, key=lambda k: votes[k]), min(score, 1.0), pairs, votes)
