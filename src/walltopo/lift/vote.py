"""The robust vote: each triangle goes to the instance that the views with that instance name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from walltopo.lift.evidence import Evidence

__all__ = ["Claims", "claims_of", "vote"]

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]

# Doubt, in views, that every instance starts with: one mask alone says less than nine of ten.
DOUBT = 1.0


def vote(
    evidence: Evidence, cluster: Ints, threshold: float, band: float
) -> tuple[Ints, NDArray[np.float32]]:
    """The cluster of each face, and the share of views that agree.

    Parameters
    ----------
    cluster : (P,) int32, cluster of each projection, -1 = none.
    band : pixels, what the evidence was gathered with: a face at a mask's border counts half,
        one this far inside fully. The mean of borders that are off by chance is surer than their
        median, which is what counting in and out amounts to.
    threshold : a face needs this share of the views that see it and hold a mask of the cluster.
        A view that missed the object altogether says nothing about its border.

    Returns
    -------
    (C,) int32, -1 = none; (C,) float32.
    """
    views = len(evidence.first_mask) - 1
    count = int(cluster.max(initial=-1)) + 1
    present = np.zeros((count, views), dtype=np.bool_)
    known = np.flatnonzero(cluster >= 0)
    present[cluster[known], evidence.view_of[known]] = True
    weight = evidence.share * evidence.detail
    # From 0 at the border to 1 at the band's end; all 1 where evidence is in or out.
    depth = evidence.border / np.float32(band) if band > 0 else np.ones_like(weight)
    mean = float(evidence.detail.mean()) if len(weight) else 1.0
    return _vote(
        evidence.starts, evidence.projection, evidence.view, weight, depth, cluster,
        present, threshold, DOUBT * mean,
    )  # fmt: skip


@njit(parallel=True, cache=True)
def _vote(
    starts: Any, projection: Any, view: Any, weight: Any, depth: Any, cluster: Any,
    present: Any, threshold: Any, doubt: Any,
) -> Any:  # fmt: skip
    count = len(starts) - 1
    winner = np.full(count, -1, dtype=np.int32)
    shares = np.zeros(count, dtype=np.float32)
    for face in prange(count):
        begin, end = starts[face], starts[face + 1]
        best = 0.0
        for k in range(begin, end):
            p = projection[k]
            if p < 0 or cluster[p] < 0 or cluster[p] == winner[face]:
                continue
            mine, total = 0.0, 0.0
            for j in range(begin, end):
                if present[cluster[p], view[j]]:
                    total += weight[j]
                    q = projection[j]
                    if q >= 0 and cluster[q] == cluster[p]:
                        mine += weight[j] * (0.5 + 0.5 * depth[j])
                    elif q < -1 and cluster[-2 - q] == cluster[p]:
                        mine += weight[j] * (0.5 - 0.5 * depth[j])
            sure = mine / (total + doubt)
            if mine >= (threshold - 1e-6) * total and (
                sure > best + 1e-9 or (sure > best - 1e-9 and cluster[p] < winner[face])
            ):
                best = sure
                winner[face] = cluster[p]
                shares[face] = mine / total
    return winner, shares


@dataclass(frozen=True, eq=False)
class Claims:
    """How projections and clusters meet on the labelled mesh.

    Parameters
    ----------
    area : (K,) float64, area of each cluster.
    projection, cluster : (n,) int32, pairs that share faces.
    shared : (n,) float64, area of the faces of both.
    seen : (n,) float64, area of the cluster that the projection's view saw.
    visible : (K, views) float64, area of each cluster that each view saw.
    """

    area: Floats
    projection: Ints
    cluster: Ints
    shared: Floats
    seen: Floats
    visible: Floats


def claims_of(evidence: Evidence, winner: Ints, count: int) -> Claims:
    """Compare all projections with the clusters as labelled (`winner` as of `vote`)."""
    views = len(evidence.first_mask) - 1
    labelled = np.repeat(winner, np.diff(evidence.starts))
    areas = np.repeat(evidence.areas, np.diff(evidence.starts)) * evidence.share
    on = labelled >= 0
    key = labelled[on].astype(np.int64) * views + evidence.view[on]
    visible = np.bincount(key, areas[on], minlength=count * views).astype(np.float64)
    visible = visible.reshape(count, views)
    on &= evidence.projection >= 0
    key = evidence.projection[on].astype(np.int64) * count + labelled[on]
    pairs, inverse = np.unique(key, return_inverse=True)
    shared = np.bincount(inverse, areas[on], minlength=len(pairs)).astype(np.float64)
    projection, cluster = (pairs // count).astype(np.int32), (pairs % count).astype(np.int32)
    seen = visible[cluster, evidence.view_of[projection]]
    own = winner >= 0
    area = np.bincount(winner[own], evidence.areas[own], minlength=count).astype(np.float64)
    return Claims(area, projection, cluster, shared, seen, visible)
