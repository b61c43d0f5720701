"""Choose the stereo partners of each photo.

The partners of a photo together cover the points that the photo sees. A partner scores for points
at a good triangulation angle that earlier partners do not cover. So a corner that only one other
photo sees gets that photo as a partner. Partners are mutual: if only two photos see a point, each
needs its own depth, or neither could confirm the other's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.reconstruct.dense.scene import Scene

Floats = NDArray[np.float64]

# Pairs that share fewer points are ignored, because their overlap is uncertain.
_MIN_SHARED = 12
# Points closer than this angle to the direction of the baseline rectify badly.
_MIN_BASELINE_ANGLE = np.deg2rad(18.0)
# Preferred triangulation angle, and the standard deviation of its natural logarithm in the score.
_BEST_ANGLE = float(np.deg2rad(9.0))
_ANGLE_SPREAD = 0.55
# Factor on a point's weight once a partner at the best angle sees it.
_COVERED_WEIGHT = 0.3
# Photos whose total score is below this share of the best one's make no pair: matching at a poor
# angle finds false depths, which would vote against the true ones.
_MIN_SCORE = 0.05
# No partner is added whose gain is below this share of the first partner's gain.
_MIN_GAIN = 0.02
# Share of its score that a candidate loses if a partner already views from the same direction.
_SAME_DIRECTION = 0.5


def _unit(vectors: Floats) -> Floats:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)


def _point_scores(scene: Scene, i: int, j: int, shared: NDArray[np.int64]) -> Floats:
    """Return the (n,) score of a pair at each shared point, 1 at the best triangulation angle."""
    a, b = scene.views[i], scene.views[j]
    baseline = b.centre - a.centre
    length = float(np.linalg.norm(baseline))
    if length == 0 or float(a.direction @ b.direction) < 0.5:
        return np.zeros(len(shared))
    rays_a = _unit(scene.points[shared] - a.centre)
    rays_b = _unit(scene.points[shared] - b.centre)
    forward = np.maximum(np.abs(rays_a @ baseline), np.abs(rays_b @ baseline)) / length
    angle = np.arccos(np.clip((rays_a * rays_b).sum(axis=1), -1.0, 1.0))
    offset = np.log(np.maximum(angle, 1e-4) / _BEST_ANGLE) / _ANGLE_SPREAD
    return np.where(forward < np.cos(_MIN_BASELINE_ANGLE), np.exp(-0.5 * offset**2), 0.0)


def choose_neighbours(scene: Scene, count: int) -> list[list[int]]:
    """Choose the stereo partners of each view, best first.

    A good partner sees much of the same surface at about the best angle, in particular the points
    that earlier partners do not cover. It also views from another side than they do, because it
    then sees behind other edges.

    Parameters
    ----------
    scene : views and points.
    count : maximum number of partners chosen per view.

    Returns
    -------
    For each view a list of view indices: at most `count` chosen partners, then the useful views
    that chose this view. The list is empty for a view without overlap.
    """
    n = len(scene.views)
    common = _shared_points(scene)
    centres = np.array([view.centre for view in scene.views])
    useful = np.zeros((n, n), dtype=np.bool_)
    partners: list[list[int]] = []
    for i, own in enumerate(scene.seen):
        others = common.indices[common.indptr[i] : common.indptr[i + 1]]
        scores = np.zeros((len(others), len(own)))
        for row, j in enumerate(others.tolist()):
            shared = np.flatnonzero(np.isin(own, scene.seen[j], assume_unique=True))
            scores[row, shared] = _point_scores(scene, i, j, own[shared])
        total = scores.sum(axis=1)
        is_useful = total > _MIN_SCORE * total.max(initial=0.0)
        useful[i, others[is_useful]] = True
        scores[~is_useful] = 0.0
        chosen = _choose_covering_rows(scores, _unit(centres[others] - centres[i]), count)
        partners.append(others[chosen].tolist())
    return _make_mutual(partners, useful)


def _shared_points(scene: Scene) -> Any:
    """Return the sparse (views, views) counts of shared points, at least `_MIN_SHARED` each."""
    from scipy.sparse import csr_array

    counts = [len(seen) for seen in scene.seen]
    starts = np.concatenate([[0], np.cumsum(counts)])
    ones = np.ones(starts[-1], np.int32)
    shape = (len(counts), len(scene.points))
    seen = csr_array((ones, np.concatenate(scene.seen), starts), shape=shape)
    common = (seen @ seen.T).tocsr()
    common.setdiag(0)
    common.data[common.data < _MIN_SHARED] = 0
    common.eliminate_zeros()
    common.sort_indices()
    return common


def _make_mutual(partners: list[list[int]], useful: NDArray[np.bool_]) -> list[list[int]]:
    """Return each view's partners, then the useful views that chose it as a partner."""
    result = [list(own) for own in partners]
    for i, own in enumerate(partners):
        for j in own:
            if useful[j, i] and i not in result[j]:
                result[j].append(i)
    return result


def _choose_covering_rows(scores: Floats, directions: Floats, count: int) -> list[int]:
    """Greedily choose the rows that add the most score to what earlier rows cover.

    Parameters
    ----------
    scores : (views, points) in [0, 1].
    directions : (views, 3) unit vectors from the photo's centre to each view's centre.
    count : maximum number of rows; fewer if the gain becomes negligible.
    """
    point_weight = np.ones(scores.shape[1])
    view_weight = np.ones(len(scores))
    chosen: list[int] = []
    first = 0.0
    while len(chosen) < min(count, len(scores)):
        gain = (scores @ point_weight) * view_weight
        gain[chosen] = 0.0
        pick = int(gain.argmax())
        first = max(first, float(gain[pick]))
        if gain[pick] <= _MIN_GAIN * first:
            break
        chosen.append(pick)
        point_weight *= _COVERED_WEIGHT ** scores[pick]
        view_weight *= 1.0 - _SAME_DIRECTION * np.clip(directions @ directions[pick], 0.0, 1.0)
    return chosen
