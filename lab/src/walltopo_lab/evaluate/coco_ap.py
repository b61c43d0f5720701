"""Average precision by the COCO protocol, on any weighted elements (faces by area).

Source: COCO's `cocoeval.py`. In order of score, each prediction takes the free true instance of
largest overlap at or above the threshold. Precision is made monotone and sampled at 101 recalls.
Unlike COCO, the number of predictions has no cap: a wall has more than 100 holds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.evaluate.overlap import Overlap

Floats = NDArray[np.float64]

COCO_THRESHOLDS = tuple(round(0.50 + 0.05 * k, 2) for k in range(10))
_RECALLS = np.linspace(0.0, 1.0, 101)


def coco_matches(scene: Overlap, threshold: float, min_size: float = 0.0) -> NDArray[np.int64]:
    """Return the index of the true instance that each prediction takes, -1 = none.

    True instances smaller than `min_size` are taken only without a larger candidate (COCO's ignored
    truth). Predictions of equal score keep their order.
    """
    iou = scene.iou()
    small = scene.truth_sizes < min_size
    at_least = min(threshold, 1 - 1e-10)
    free = np.ones(len(scene.truth_sizes), dtype=np.bool_)
    taken = np.full(len(scene.pred_sizes), -1, dtype=np.int64)
    for p in np.argsort(-scene.pred_scores, kind="stable"):
        for group in (~small, small):
            candidates = np.flatnonzero(free & group & (iou[p] >= at_least))
            if len(candidates):
                # COCO's loop keeps the last of equal candidates.
                best = candidates[::-1][np.argmax(iou[p, candidates[::-1]])]
                taken[p] = best
                free[best] = False
                break
    return taken


def average_precision(
    scores: Floats, hits: NDArray[np.bool_], truth: int, every_point: bool = False
) -> float:
    """Return the area under the monotone precision-recall curve, at 101 recalls.

    Parameters
    ----------
    scores, hits : (n,) score of each detection, and whether it took a true object.
    truth : number of true objects, > 0.
    every_point : integrate over every reached recall, instead of COCO's 101.
    """
    if len(hits) == 0:
        return 0.0
    hit = hits[np.argsort(-scores, kind="stable")]
    positives = np.cumsum(hit)
    precision = positives / np.arange(1, len(hit) + 1)
    precision = np.maximum.accumulate(precision[::-1])[::-1]
    if every_point:
        return float((precision * hit).sum() / truth)
    at = np.searchsorted(positives / truth, _RECALLS, side="left")
    return float(np.where(at < len(hit), precision[np.minimum(at, len(hit) - 1)], 0.0).mean())


def _ap_at(
    scenes: Sequence[Overlap],
    threshold: float,
    min_size: float,
    truth: int,
    every_point: bool = False,
) -> float:
    scores: list[Floats] = []
    hits: list[NDArray[np.bool_]] = []
    for scene in scenes:
        taken = coco_matches(scene, threshold, min_size)
        matched = taken >= 0
        ignored = np.zeros(len(taken), dtype=np.bool_)
        ignored[matched] = scene.truth_sizes[taken[matched]] < min_size
        ignored[~matched] = scene.pred_sizes[~matched] < min_size
        scores.append(scene.pred_scores[~ignored])
        hits.append(matched[~ignored])
    return average_precision(np.concatenate(scores), np.concatenate(hits), truth, every_point)


def coco_ap(
    scenes: Sequence[Overlap],
    thresholds: Sequence[float] = COCO_THRESHOLDS,
    min_size: float = 0.0,
) -> Floats:
    """Return the AP of one class over several scenes at each threshold; `scannet_ap` defines the
    terms.

    Returns
    -------
    (len(thresholds),) float; 0 with truth but no prediction, NaN without truth.
    """
    truth = sum(int((scene.truth_sizes >= min_size).sum()) for scene in scenes)
    if truth == 0:
        return np.full(len(thresholds), np.nan)
    return np.array([_ap_at(scenes, t, min_size, truth) for t in thresholds])


def exact_ap(scenes: Sequence[Overlap], thresholds: Sequence[float]) -> Floats:
    """Return (len(thresholds),) AP with COCO's matching, integrated over every reached recall."""
    truth = sum(len(scene.truth_sizes) for scene in scenes)
    return np.array([_ap_at(scenes, t, 0.0, truth, every_point=True) for t in thresholds])
