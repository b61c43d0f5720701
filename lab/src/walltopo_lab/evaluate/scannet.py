"""Average precision by the ScanNet protocol.

Source: ScanNet benchmark, `evaluate_semantic_instance.py` (Dai et al., CVPR 2017). An overlap
counts if it is strictly above the threshold. Each prediction is used once. The lower-scored of two
predictions on one true instance is false. A false prediction mostly in void or in ignored truth is
excused. The curve has one point per distinct confidence and is integrated by the trapezoid-like
rule of that file (no interpolation).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.evaluate.overlap import Overlap

Floats = NDArray[np.float64]

# .50 to .90 in steps of .05; the benchmark reports .25 separately.
SCANNET_THRESHOLDS = tuple(round(0.50 + 0.05 * k, 2) for k in range(9))


def _match_scene(
    scene: Overlap, threshold: float, min_size: float
) -> tuple[list[float], list[bool], int]:
    """Return scores and hit flags of one scene's predictions, and the number of missed true
    instances.
    """
    iou = scene.iou()
    counted = scene.truth_sizes >= min_size
    used = np.zeros(len(scene.pred_sizes), dtype=np.bool_)
    scores: list[float] = []
    hits: list[bool] = []
    missed = 0
    for t in np.flatnonzero(counted):
        candidates = np.flatnonzero((iou[:, t] > threshold) & ~used)
        if len(candidates) == 0:
            missed += 1
            continue
        # As in the original, only the first candidate is marked used. The others stay free for
        # another true instance that they overlap.
        used[candidates[0]] = True
        best = candidates[np.argmax(scene.pred_scores[candidates])]
        for p in candidates:
            scores.append(float(scene.pred_scores[p]))
            hits.append(bool(p == best))
    unmatched = ~(iou[:, counted] > threshold).any(axis=1)
    excused = scene.pred_void + scene.shared[:, ~counted].sum(axis=1)
    for p in np.flatnonzero(unmatched):
        if excused[p] <= threshold * scene.pred_sizes[p]:
            scores.append(float(scene.pred_scores[p]))
            hits.append(False)
    return scores, hits, missed


def _area_under_curve(scores: Floats, hits: NDArray[np.bool_], missed: int) -> float:
    order = np.argsort(scores, kind="stable")
    sorted_hits = hits[order]
    _, first = np.unique(scores[order], return_index=True)
    below = np.concatenate([[0], np.cumsum(sorted_hits)])[first]  # hits under each confidence
    true_positive = sorted_hits.sum() - below
    truth = sorted_hits.sum() + missed
    precision = np.append(true_positive / (len(scores) - first), 1.0)
    recall = np.append(true_positive / truth, 0.0)
    padded = np.concatenate([recall[:1], recall, [0.0]])
    return float(precision @ (0.5 * (padded[:-2] - padded[2:])))


def scannet_ap(
    scenes: Sequence[Overlap],
    thresholds: Sequence[float] = SCANNET_THRESHOLDS,
    min_size: float = 0.0,
) -> Floats:
    """Return the AP of one class over several scenes, at each threshold.

    Parameters
    ----------
    scenes : overlaps of the instances of one class (see `Overlap.select`).
    thresholds : intersection over union to exceed.
    min_size : smaller true instances are ignored, in the unit of the weights. The benchmark uses
        100 vertices; the default keeps every instance.

    Returns
    -------
    (len(thresholds),) float; 0 with truth but no prediction, NaN without truth.
    """
    if not any((scene.truth_sizes >= min_size).any() for scene in scenes):
        return np.full(len(thresholds), np.nan)
    result = np.zeros(len(thresholds))
    for k, threshold in enumerate(thresholds):
        parts = [_match_scene(scene, threshold, min_size) for scene in scenes]
        scores = np.array([s for part in parts for s in part[0]])
        hits = np.array([h for part in parts for h in part[1]], dtype=np.bool_)
        if len(scores):
            result[k] = _area_under_curve(scores, hits, sum(part[2] for part in parts))
    return result
