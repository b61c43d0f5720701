"""The robust vote: each triangle goes to the instance with the most votes; and the clustering."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, View
from walltopo.geometry.graphs import renumber
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.segment.lift.evidence import Evidence
from walltopo.segment.lift.label_image import drawing_order
from walltopo.segment.lift.settings import LiftParams, OnTop
from walltopo.segment.lift.similarity import Covisible

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]

# Number of views without a mask that every instance starts with: nine masks in ten views then
# outweigh one mask in one view.
PRIOR_VIEWS = 1.0


def vote(evidence: Evidence, cluster: Ints, params: LiftParams) -> tuple[Ints, NDArray[np.float32]]:
    """Return the cluster of each face, and the share of views that agree.

    Parameters
    ----------
    cluster : (P,) int32, cluster of each projection, -1 = none.
    params : `border_band` must be the band with which the evidence was gathered. A face at a
        mask's border counts half, and a face this far inside counts fully. The mean of borders
        with random errors is more precise than their median, which hard borders amount to. A face
        needs the share `threshold` of the views that see it and, by `voters`, have a mask of the
        cluster: a view that misses the object altogether gives no evidence about its border.

    Returns
    -------
    (C,) int32, the cluster of each face, -1 = none; (C,) float32, the share.
    """
    views = len(evidence.first_mask) - 1
    count = int(cluster.max(initial=-1)) + 1
    band = params.border_band
    present = np.full((count, views), params.voters == "all")
    known = np.flatnonzero(cluster >= 0)
    present[cluster[known], evidence.view_of[known]] = True
    weight = evidence.share * evidence.detail
    # 0 at the border and 1 at the end of the band; all 1 with hard borders.
    depth = evidence.border / np.float32(band) if band > 0 else np.ones_like(weight)
    mean = float(evidence.detail.mean()) if len(weight) else 1.0
    faces = len(evidence.faces)
    winner = np.full(faces, -1, dtype=np.int32)
    shares = np.zeros(faces, dtype=np.float32)
    in_ranges(
        _vote,
        faces,
        evidence.starts,
        evidence.projection,
        evidence.view,
        cluster,
        params.threshold,
        weight,
        depth,
        present,
        PRIOR_VIEWS * mean,
        winner,
        shares,
    )
    return winner, shares


@kernel
def _tally(
    begin: Any,
    end: Any,
    candidate: Any,
    projection: Any,
    view: Any,
    cluster: Any,
    weight: Any,
    depth: Any,
    present: Any,
) -> Any:
    """Return the evidence for a cluster on one face, and all evidence of views that vote on it."""
    mine, total = 0.0, 0.0
    for j in range(begin, end):
        if present[candidate, view[j]]:
            total += weight[j]
            q = projection[j]
            if q >= 0 and cluster[q] == candidate:
                mine += weight[j] * (0.5 + 0.5 * depth[j])
            elif q < -1 and cluster[-2 - q] == candidate:
                mine += weight[j] * (0.5 - 0.5 * depth[j])
    return mine, total


@kernel
def _vote(
    begin_face: Any,
    end_face: Any,
    starts: Any,
    projection: Any,
    view: Any,
    cluster: Any,
    threshold: Any,
    weight: Any,
    depth: Any,
    present: Any,
    prior: Any,
    winner: Any,
    shares: Any,
) -> None:
    for face in range(begin_face, end_face):
        begin, end = starts[face], starts[face + 1]
        best, last = 0.0, -1
        for k in range(begin, end):
            p = projection[k]
            # Most entries name the cluster of the previous entry, which is counted already.
            if p < 0 or cluster[p] < 0 or cluster[p] == winner[face] or cluster[p] == last:
                continue
            last = cluster[p]
            mine, total = _tally(
                begin, end, cluster[p], projection, view, cluster, weight, depth, present
            )
            confidence = mine / (total + prior)
            tied = confidence > best - 1e-9 and cluster[p] < winner[face]
            if mine >= (threshold - 1e-6) * total and (confidence > best + 1e-9 or tied):
                best = confidence
                winner[face] = cluster[p]
                shares[face] = mine / total


@dataclass(frozen=True, eq=False)
class Claims:
    """Overlaps of projections with clusters on the labelled mesh.

    Parameters
    ----------
    area : (K,) float64, area of each cluster.
    projection, cluster : (n,) int32, pairs that share faces.
    shared : (n,) float64, area of the faces in both.
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
    """Return the overlaps of all projections with the labelled clusters (`winner` of `vote`)."""
    views = len(evidence.first_mask) - 1
    visible = _visible(
        evidence.starts, evidence.view, evidence.share, evidence.areas, winner, count, views
    )
    own = winner >= 0
    area = np.bincount(winner[own], evidence.areas[own], minlength=count).astype(np.float64)
    # A projection overlaps at most as many clusters as it has faces.
    rows = pairs.rows
    max_met = np.minimum(np.diff(rows.starts), count)
    places = np.zeros(len(max_met) + 1, dtype=np.int64)
    np.cumsum(max_met, out=places[1:])
    met = np.full(places[-1], -1, dtype=np.int32)
    shared = np.zeros(places[-1])
    in_ranges(
        _write_overlaps,
        len(max_met),
        rows.starts,
        rows.number,
        rows.entry,
        evidence.share,
        evidence.areas,
        winner,
        count,
        places,
        met,
        shared,
    )
    used = met >= 0
    projection = np.repeat(np.arange(len(max_met), dtype=np.int32), max_met)[used]
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
def _write_overlaps(
    begin: Any,
    stop: Any,
    starts: Any,
    number: Any,
    entry: Any,
    share: Any,
    areas: Any,
    winner: Any,
    clusters: Any,
    places: Any,
    met: Any,
    shared: Any,
) -> None:
    """Write the clusters that each projection overlaps to `met`, and the shared areas to `shared`.

    `winner`: cluster of each triangle; `clusters`: their number; `places`: each projection's part
    of the outputs.
    """
    slot = np.full(clusters, -1, dtype=np.int64)
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


# Two masks of one view with at least this IoU are duplicates.
DUPLICATE_IOU = 0.7


def tidy_order(view: View, on_top: OnTop, drop_duplicates: bool) -> list[int]:
    """Return the drawing order; of duplicate masks, keep only the one with the higher score."""
    masks = view.masks
    order = drawing_order(view, on_top)
    if drop_duplicates:
        order = _without_duplicates(masks, [mask.area for mask in masks], order)
    return order


def _without_duplicates(masks: tuple[Mask, ...], areas: list[int], order: list[int]) -> list[int]:
    """Return `order` without the masks that duplicate a mask with a higher score."""
    # Duplicates have centres closer than the side of the largest box, so a hash finds them.
    cell = max((max(masks[k].bitmap.shape) for k in order), default=1)
    table: dict[tuple[int, int], list[int]] = {}
    dropped = set()
    for k in sorted(order, key=lambda k: (-masks[k].score, k)):
        x, y, w, h = masks[k].box
        col, row = (2 * x + w) // (2 * cell), (2 * y + h) // (2 * cell)
        near = [
            other
            for dx in (-1, 0, 1)
            for dy in (-1, 0, 1)
            for other in table.get((col + dx, row + dy), ())
        ]
        if any(_duplicate(masks[k], masks[other], areas[k], areas[other]) for other in near):
            dropped.add(k)
        else:
            table.setdefault((col, row), []).append(k)
    return [k for k in order if k not in dropped]


def _duplicate(one: Mask, other: Mask, area: int, other_area: int) -> bool:
    """Return whether two masks overlap by `DUPLICATE_IOU`; test boxes and areas before pixels."""
    if (one.width, one.height) != (other.width, other.height):
        return False
    x0, y0 = max(one.x, other.x), max(one.y, other.y)
    x1 = min(one.x + one.bitmap.shape[1], other.x + other.bitmap.shape[1])
    y1 = min(one.y + one.bitmap.shape[0], other.y + other.bitmap.shape[0])
    if x1 <= x0 or y1 <= y0:
        return False
    max_shared = min((x1 - x0) * (y1 - y0), area, other_area)
    if max_shared < DUPLICATE_IOU * (area + other_area - max_shared):
        return False
    mine = one.bitmap[y0 - one.y : y1 - one.y, x0 - one.x : x1 - one.x]
    theirs = other.bitmap[y0 - other.y : y1 - other.y, x0 - other.x : x1 - other.x]
    shared = int(np.count_nonzero(mine & theirs))
    return shared >= DUPLICATE_IOU * (area + other_area - shared)


def potts_clusters(count: int, first: Ints, second: Ints, weight: Floats, cohesion: float) -> Ints:
    """Return the clusters of a graph by the constant Potts model, visiting vertices in order.

    Parameters
    ----------
    count : number of vertices.
    first, second, weight : (E,) edges, each pair once, weights in [0, 1]; pairs without an edge
        count as weight 0.
    cohesion : in (0, 1): larger gives more and smaller clusters.

    Returns
    -------
    (count,) int32, numbered from 0 in the order of their first vertex.
    """
    member = np.arange(count, dtype=np.int64)
    size: Floats = np.ones(count, dtype=np.float64)
    p, q, w = first.astype(np.int64), second.astype(np.int64), weight.astype(np.float64)
    while True:
        starts, ends, weights = _adjacency(len(size), p, q, w)
        cluster = np.arange(len(size))
        _move(starts, ends, weights, size, cohesion, cluster, size.copy(), np.zeros(len(size)))
        _, found = np.unique(cluster, return_inverse=True)
        groups = int(found.max(initial=-1)) + 1
        member = found[member]
        if groups == len(size):
            return renumber(member)
        size = np.bincount(found, size, minlength=groups).astype(np.float64)
        # Keep only the edges between different new vertices.
        a, b = np.minimum(found[p], found[q]), np.maximum(found[p], found[q])
        between = a != b
        pairs, place = np.unique(a[between] * groups + b[between], return_inverse=True)
        w = np.bincount(place, w[between], minlength=len(pairs)).astype(np.float64)
        p, q = pairs // groups, pairs % groups


@kernel
def _adjacency(count: Any, p: Any, q: Any, w: Any) -> Any:
    """Return the neighbours of each vertex, those after it first: starts, ends, weights."""
    starts = np.zeros(count + 1, dtype=np.int64)
    for e in range(len(p)):
        starts[p[e] + 1] += 1
        starts[q[e] + 1] += 1
    for v in range(count):
        starts[v + 1] += starts[v]
    place = starts[:-1].copy()
    ends, weights = np.zeros(2 * len(p), dtype=np.int64), np.zeros(2 * len(p))
    for source, target in ((p, q), (q, p)):
        for e in range(len(p)):
            at = place[source[e]]
            ends[at], weights[at] = target[e], w[e]
            place[source[e]] += 1
    return starts, ends, weights


@kernel
def _move(
    starts: Any,
    ends: Any,
    weights: Any,
    size: Any,
    cohesion: Any,
    cluster: Any,
    total: Any,
    to: Any,
) -> None:
    """Move each vertex to the neighbouring cluster with the greatest gain, until none gains.

    Parameters
    ----------
    cluster : (n,) cluster of each vertex, changed in place; total : (n,) size of each cluster,
        kept up to date; to : (n,) zeros, used as a buffer.
    """
    count = len(size)
    moved = True
    while moved:
        moved = False
        for v in range(count):
            own = cluster[v]
            for k in range(starts[v], starts[v + 1]):
                to[cluster[ends[k]]] += weights[k]
            total[own] -= size[v]
            best, target = to[own] - cohesion * size[v] * total[own], own
            for k in range(starts[v], starts[v + 1]):
                other = cluster[ends[k]]
                gain = to[other] - cohesion * size[v] * total[other]
                if gain > best + 1e-12:
                    best, target = gain, other
            total[target] += size[v]
            if target != own:
                cluster[v] = target
                moved = True
            for k in range(starts[v], starts[v + 1]):
                to[cluster[ends[k]]] = 0.0
            to[own] = 0.0
