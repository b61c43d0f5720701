"""Merge and threshold, as published: from clusters of projections to labels of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from walltopo.core import Instance, Instances
from walltopo.lifting.evidence import Evidence

__all__ = ["TIE", "literal_instances", "literal_labels"]

Ints = NDArray[np.int32]

# Shares within this of the threshold count as reaching it, so that the order in which floats
# are summed decides nothing.
TIE = 1e-6


def literal_labels(
    evidence: Evidence, cluster: Ints, threshold: float
) -> tuple[Ints, NDArray[np.float32]]:
    """The cluster that keeps each face, and the share of its positive evidence.

    Parameters
    ----------
    cluster : (P,) int32, cluster of each projection.

    Returns
    -------
    (C,) int32, -1 = none keeps it, and (C,) float32. Where clusters (of several classes, or at
    a low threshold) keep the same face it goes to the greatest share, then the lowest number.
    """
    weight = (evidence.share * evidence.ease).astype(np.float64)
    return _vote(
        evidence.starts, evidence.projection, weight, evidence.score, evidence.label, cluster,
        threshold,
    )  # fmt: skip


@njit(parallel=True, cache=True)
def _vote(
    starts: Any, projection: Any, weight: Any, score: Any, label: Any, cluster: Any, threshold: Any
) -> Any:
    count = len(starts) - 1
    kept = np.full(count, -1, dtype=np.int32)
    shares = np.zeros(count, dtype=np.float32)
    for face in prange(count):
        begin, end = starts[face], starts[face + 1]
        uncovered = 0.0
        for k in range(begin, end):
            if projection[k] < 0:
                uncovered += weight[k]
        best, winner = -1.0, -1
        for k in range(begin, end):
            p = projection[k]
            if p < 0:
                continue
            mine, same = 0.0, 0.0
            for j in range(begin, end):
                q = projection[j]
                if q >= 0 and label[q] == label[p]:
                    value = weight[j] * score[q]
                    same += value
                    if cluster[q] == cluster[p]:
                        mine += value
            total = uncovered + same
            share = mine / total if total > 0 else 0.0
            reaches = share >= threshold - TIE and mine > 0
            better = share > best + TIE or (share > best - TIE and cluster[p] < winner)
            if reaches and better:
                best, winner = share, cluster[p]
        if winner >= 0:
            kept[face] = winner
            shares[face] = best
    return kept, shares


def literal_instances(
    evidence: Evidence, cluster: Ints, kept: Ints, shares: NDArray[np.float32], faces: int
) -> Instances:
    """Instances of the clusters that kept a face, numbered in the order of clusters.

    The published method gives no confidence: an instance's score is the area-weighted mean
    share of positive evidence of its faces.
    """
    face_instance = np.zeros(faces, dtype=np.int32)
    face_score = np.zeros(faces, dtype=np.float32)
    alive = np.unique(kept[kept >= 0])
    view_of = evidence.view_of
    records = []
    for number, found in enumerate(alive, start=1):
        mine = kept == found
        face_instance[evidence.faces[mine]] = number
        face_score[evidence.faces[mine]] = shares[mine]
        members = np.flatnonzero(cluster == found)
        label = int(evidence.label[members[0]])
        areas = evidence.areas[mine]
        score = float(np.average(shares[mine], weights=areas))
        views = tuple((int(view_of[p]), int(p - evidence.first_mask[view_of[p]])) for p in members)
        records.append(Instance(number, label, min(score, 1.0), views, {label: 1.0}))
    return Instances(face_instance, face_score, tuple(records))
