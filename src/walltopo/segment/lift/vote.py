"""The robust vote: each triangle goes to the instance that most views with that instance name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.segment.lift.evidence import Evidence
from walltopo.segment.lift.settings import LiftParams
from walltopo.segment.lift.similarity import Covisible

Ints = NDArray[np.int32]


Floats = NDArray[np.float64]

# Doubt, in views, that every instance starts with: one mask alone says less than nine of ten.
DOUBT = 1.0


def vote(evidence: Evidence, cluster: Ints, params: LiftParams) -> tuple[Ints, NDArray[np.float32]]:
    """The cluster of each face, and the share of views that agree.

    Parameters
    ----------
    cluster : (P,) int32, cluster of each projection, -1 = none.
    params : `border_band` is what the evidence was gathered with: a face at a mask's border counts
        half, one this far inside fully. The mean of borders that are off by chance is surer than
        their median, which is what counting in and out amounts to. A face needs the share
        `threshold` of the views that see it and, by `voters`, hold a mask of the cluster: a view
        that missed the object altogether says nothing about its border.

    Returns
    -------
    (C,) int32, -1 = none; (C,) float32.
    """
    views = len(evidence.first_mask) - 1
    count = int(cluster.max(initial=-1)) + 1
    band = params.border_band
    present = np.full((count, views), params.voters == "all")
    known = np.flatnonzero(cluster >= 0)
    present[cluster[known], evidence.view_of[known]] = True
    weight = evidence.share * evidence.detail
    # From 0 at the border to 1 at the band's end; all 1 where evidence is in or out.
    depth = evidence.border / np.float32(band) if band > 0 else np.ones_like(weight)
    mean = float(evidence.detail.mean()) if len(weight) else 1.0
    faces = len(evidence.faces)
    winner = np.full(faces, -1, dtype=np.int32)
    shares = np.zeros(faces, dtype=np.float32)
    in_ranges(
        _vote, faces, evidence.starts, evidence.projection, evidence.view, cluster,
        params.threshold, weight, depth, present, DOUBT * mean, winner, shares,
    )  # fmt: skip
    return winner, shares


@kernel
def _tally(
    begin: Any, end: Any, wanted: Any, projection: Any, view: Any, cluster: Any, weight: Any,
    depth: Any, present: Any,
) -> Any:  # fmt: skip
    """Evidence for a cluster on one face, and all evidence of the views that hold it."""
    mine, total = 0.0, 0.0
    for j in range(begin, end):
        if present[wanted, view[j]]:
            total += weight[j]
            q = projection[j]
            if q >= 0 and cluster[q] == wanted:
                mine += weight[j] * (0.5 + 0.5 * depth[j])
            elif q < -1 and cluster[-2 - q] == wanted:
                mine += weight[j] * (0.5 - 0.5 * depth[j])
    return mine, total


@kernel
def _vote(
    begin_face: Any, end_face: Any, starts: Any, projection: Any, view: Any, cluster: Any,
    threshold: Any, weight: Any, depth: Any, present: Any, doubt: Any, winner: Any, shares: Any,
) -> None:  # fmt: skip
    for face in range(begin_face, end_face):
        begin, end = starts[face], starts[face + 1]
        best, last = 0.0, -1
        for k in range(begin, end):
            p = projection[k]
            # Most entries name the cluster of the one before, which was asked already.
            if p < 0 or cluster[p] < 0 or cluster[p] == winner[face] or cluster[p] == last:
                continue
            last = cluster[p]
            mine, total = _tally(
                begin, end, cluster[p], projection, view, cluster, weight, depth, present
            )
            sure = mine / (total + doubt)
            if mine >= (threshold - 1e-6) * total and (
                sure > best + 1e-9 or (sure > best - 1e-9 and cluster[p] < winner[face])
            ):
                best = sure
                winner[face] = cluster[p]
                shares[face] = mine / total


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


def claims_of(evidence: Evidence, pairs: Covisible, winner: Ints, count: int) -> Claims:
    """Compare all projections with the clusters as labelled (`winner` as of `vote`)."""
    views = len(evidence.first_mask) - 1
    visible = _visible(
        evidence.starts, evidence.view, evidence.share, evidence.areas, winner, count, views
    )
    own = winner >= 0
    area = np.bincount(winner[own], evidence.areas[own], minlength=count).astype(np.float64)
    # A projection meets at most as many clusters as it has faces.
    rows = pairs.rows
    most = np.minimum(np.diff(rows.starts), count)
    places = np.zeros(len(most) + 1, dtype=np.int64)
    np.cumsum(most, out=places[1:])
    met = np.full(places[-1], -1, dtype=np.int32)
    shared = np.zeros(places[-1])
    in_ranges(
        _meet, len(most), rows.starts, rows.number, rows.entry, evidence.share, evidence.areas,
        winner, count, places, met, shared,
    )  # fmt: skip
    used = met >= 0
    projection = np.repeat(np.arange(len(most), dtype=np.int32), most)[used]
    seen = visible[met[used], evidence.view_of[projection]]
    return Claims(area, projection, met[used], shared[used], seen, visible)


@kernel
def _visible(
    starts: Any, view: Any, share: Any, areas: Any, winner: Any, count: Any, views: Any
) -> Any:
    visible = np.zeros((count, views))
    for face in range(len(starts) - 1):
        if winner[face] >= 0:
            for k in range(starts[face], starts[face + 1]):
                visible[winner[face], view[k]] += areas[face] * share[k]
    return visible


@kernel
def _meet(
    begin: Any, stop: Any, starts: Any, number: Any, entry: Any, share: Any, areas: Any,
    winner: Any, count: Any, places: Any, met: Any, shared: Any,
) -> None:  # fmt: skip
    slot = np.full(count, -1, dtype=np.int64)
    for p in range(begin, stop):
        end = places[p]
        for r in range(starts[p], starts[p + 1]):
            c = winner[number[r]]
            if c < 0:
                continue
            if slot[c] < places[p]:
                slot[c] = end
                met[end] = c
                end += 1
            shared[slot[c]] += areas[number[r]] * share[entry[r]]
