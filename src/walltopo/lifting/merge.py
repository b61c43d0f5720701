"""Merge and threshold, as published: from clusters of projections to faces of instances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instance, Instances
from walltopo.kernels import in_ranges, kernel
from walltopo.lifting.contract import Confidence
from walltopo.lifting.evidence import Evidence

__all__ = [
    "TIE",
    "Kept",
    "confidence_of",
    "keep_faces",
    "literal_instances",
    "one_each",
    "projection_scores",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# Shares within this of the threshold count as reaching it, so that the order in which floats
# are summed decides nothing.
TIE = 1e-6


@dataclass(frozen=True, eq=False)
class Kept:
    """The faces that each cluster keeps; clusters of different classes may keep the same face.

    Parameters
    ----------
    face : (n,) int64, indices into `Evidence.faces`, ascending.
    cluster : (n,) int32, ascending within a face.
    share : (n,) float32, of positive evidence.
    """

    face: NDArray[np.int64]
    cluster: Ints
    share: NDArray[np.float32]


def projection_scores(evidence: Evidence) -> Floats:
    """(P,) `p.score`: the mean of its triangles' scores; 0 for a projection without triangles."""
    positive = evidence.projection >= 0
    owner = evidence.projection[positive]
    scores = evidence.ease[positive].astype(np.float64) * evidence.score[owner]
    count = len(evidence.label)
    sizes = np.bincount(owner, minlength=count)
    return np.asarray(np.bincount(owner, scores, minlength=count) / np.maximum(sizes, 1))


def keep_faces(evidence: Evidence, cluster: Ints, threshold: float) -> Kept:
    """Every face with every cluster that keeps it (the publication's Algorithms 5 to 7).

    Parameters
    ----------
    cluster : (P,) int32, cluster of each projection.
    """
    common = (
        _keep, len(evidence.faces),
        evidence.starts, evidence.projection, evidence.ease.astype(np.float64), evidence.score,
        projection_scores(evidence), evidence.label, cluster, threshold,
    )  # fmt: skip
    places = np.zeros(len(evidence.starts), dtype=np.int64)
    found = np.zeros(len(evidence.faces), dtype=np.int64)
    nothing = np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.float32)
    in_ranges(*common, places, found, *nothing)
    np.cumsum(found, out=places[1:])
    owner = np.zeros(places[-1], dtype=np.int32)
    share = np.zeros(places[-1], dtype=np.float32)
    found[:] = 0
    in_ranges(*common, places, found, owner, share)
    face = np.repeat(np.arange(len(places) - 1), np.diff(places))
    order = np.lexsort((owner, face))
    return Kept(face, owner[order], share[order])


@kernel
def _keep(
    first_face: Any, end_face: Any, starts: Any, projection: Any, ease: Any, score: Any,
    mean: Any, label: Any, cluster: Any, threshold: Any, places: Any, found: Any, owner: Any,
    share: Any,
) -> None:  # fmt: skip
    """How many clusters keep each face; where `owner` is not empty, which, from `places` on."""
    for face in range(first_face, end_face):
        begin, end = starts[face], starts[face + 1]
        uncovered = 0.0
        for k in range(begin, end):
            if projection[k] < 0:
                uncovered += ease[k]
        for k in range(begin, end):
            p = projection[k]
            if p < 0:
                continue
            first = True
            positive, negative = 0.0, uncovered
            for j in range(begin, end):
                q = projection[j]
                if q < 0:
                    continue
                if cluster[q] == cluster[p]:
                    first = first and j >= k
                    positive += mean[q]
                elif label[q] == label[p]:
                    negative += ease[j] * score[q]
            total = positive + negative
            if first and positive > 0 and positive >= (threshold - TIE) * total:
                if len(owner):
                    owner[places[face] + found[face]] = cluster[p]
                    share[places[face] + found[face]] = positive / total
                found[face] += 1


def one_each(kept: Kept, count: int) -> tuple[Ints, NDArray[np.float32]]:
    """One cluster a face: the greatest share, then the lowest number.

    This is not in the publication, whose instances of two classes may overlap: a labelled mesh
    has one label a triangle.

    Returns
    -------
    (count,) int32, -1 = none keeps it, and (count,) float32.
    """
    winner = np.full(count, -1, dtype=np.int32)
    shares = np.zeros(count, dtype=np.float32)
    # Shares within a tie are equal, whatever rounding says. The last write wins.
    order = np.lexsort((-kept.cluster, np.round(kept.share / TIE), kept.face))
    winner[kept.face[order]] = kept.cluster[order]
    shares[kept.face[order]] = kept.share[order]
    return winner, shares


def confidence_of(way: Confidence, scores: Floats, shares: Floats, areas: Floats) -> float:
    """How sure an instance is, in [0, 1].

    Parameters
    ----------
    scores : (n,) `p.score` of its projections. Their sum is told as s / (1 + s).
    shares, areas : (m,) share of positive evidence, and area, of its faces.
    """
    if way == "share":
        return min(float(np.average(shares, weights=areas)), 1.0)
    total = float(scores.sum())
    return total / len(scores) if way == "mean" else total / (1 + total)


def literal_instances(
    evidence: Evidence,
    cluster: Ints,
    winner: Ints,
    shares: NDArray[np.float32],
    faces: int,
    way: Confidence,
) -> Instances:
    """Instances of the clusters that have a face, numbered in the order of clusters.

    Parameters
    ----------
    winner, shares : of `one_each`; faces : of the mesh.
    """
    face_instance = np.zeros(faces, dtype=np.int32)
    face_score = np.zeros(faces, dtype=np.float32)
    scores = projection_scores(evidence)
    view_of = evidence.view_of
    records = []
    for number, found in enumerate(np.unique(winner[winner >= 0]), start=1):
        mine = winner == found
        face_instance[evidence.faces[mine]] = number
        face_score[evidence.faces[mine]] = shares[mine]
        members = np.flatnonzero(cluster == found)
        label = int(evidence.label[members[0]])
        sure = confidence_of(
            way, scores[members], shares[mine].astype(np.float64), evidence.areas[mine]
        )
        views = tuple((int(view_of[p]), int(p - evidence.first_mask[view_of[p]])) for p in members)
        records.append(Instance(number, label, sure, views, {label: 1.0}))
    return Instances(face_instance, face_score, tuple(records))
