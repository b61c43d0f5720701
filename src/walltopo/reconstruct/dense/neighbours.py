"""Which photos make good stereo pairs.

Each photo's partners are chosen such that together they see what it sees: a partner counts for
the points under a good angle that the ones before it left, so that the corner of a photo where
only one other photo looks gets that one. Partners are mutual: where just two photos look, each
must have its own depth, or neither could confirm the other's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.reconstruct.dense.scene import Scene

Floats = NDArray[np.float64]

# Pairs that share fewer points than this say too little about their overlap.
_MIN_SHARED = 12
# Points that lie closer than this to the direction of the baseline cannot be rectified usefully.
_MIN_ASIDE = np.deg2rad(18.0)
# The triangulation angle that partners should have, and the width (natural logarithm) of that
# preference.
_BEST_ANGLE = float(np.deg2rad(9.0))
_ANGLE_SPREAD = 0.55
# What a point still counts for once a partner at the best angle sees it.
_LEFT_OVER = 0.3
# Photos whose worth over all points is below this share of the best one's make no pair: matching
# from too far aside finds false depths, which would speak against the true ones.
_LEAST_WORTH = 0.05
# A partner that adds less than this share of what the first gave is not worth its time.
_LEAST_GAIN = 0.02
# How much of a partner's worth a direction loses that another partner already looks from.
_SAME_DIRECTION = 0.5


def _unit(vectors: Floats) -> Floats:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)


def _point_worth(scene: Scene, i: int, j: int, shared: NDArray[np.int64]) -> Floats:
    """(n,) worth of the pair at each shared point: 1 at the best triangulation angle."""
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
    return np.where(forward < np.cos(_MIN_ASIDE), np.exp(-0.5 * offset**2), 0.0)


def choose_neighbours(scene: Scene, count: int) -> list[list[int]]:
    """Stereo partners of each view, best first.

    A partner should see much of the same surface under about the best angle, first of all what
    the partners before it do not see, and from another side of the photo than they, because it
    then sees behind other edges.

    Parameters
    ----------
    scene : views and points.
    count : partners wanted.

    Returns
    -------
    list per view of indices of views: at most `count` of its own choice, then those that chose
    it, if they are useful to it; empty where nothing overlaps.
    """
    n = len(scene.views)
    common = _shared_points(scene)
    centres = np.array([view.centre for view in scene.views])
    useful = np.zeros((n, n), dtype=np.bool_)
    partners: list[list[int]] = []
    for i, own in enumerate(scene.seen):
        others = common.indices[common.indptr[i] : common.indptr[i + 1]]
        worth = np.zeros((len(others), len(own)))
        for row, j in enumerate(others.tolist()):
            shared = np.flatnonzero(np.isin(own, scene.seen[j], assume_unique=True))
            worth[row, shared] = _point_worth(scene, i, j, own[shared])
        total = worth.sum(axis=1)
        is_useful = total > _LEAST_WORTH * total.max(initial=0.0)
        useful[i, others[is_useful]] = True
        worth[~is_useful] = 0.0
        chosen = _cover(worth, _unit(centres[others] - centres[i]), count)
        partners.append(others[chosen].tolist())
    return _mutual(partners, useful)


def _shared_points(scene: Scene) -> Any:
    """(views, views) sparse: how many points two views share, where that is enough.

    Of many photos each shares points with a few.
    """
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


def _mutual(partners: list[list[int]], useful: NDArray[np.bool_]) -> list[list[int]]:
    """Each view's partners, then the views that have it as a partner and are useful to it."""
    both = [list(own) for own in partners]
    for i, own in enumerate(partners):
        for j in own:
            if useful[j, i] and i not in both[j]:
                both[j].append(i)
    return both


def _cover(worth: Floats, directions: Floats, count: int) -> list[int]:
    """Greedy choice of the rows that add most, given what those before them cover.

    Parameters
    ----------
    worth : (views, points) in [0, 1].
    directions : (views, 3) unit, from the photo to each view's centre.
    count : rows wanted; fewer where more would add next to nothing.
    """
    left = np.ones(worth.shape[1])
    spread = np.ones(len(worth))
    chosen: list[int] = []
    first = 0.0
    while len(chosen) < min(count, len(worth)):
        gain = (worth @ left) * spread
        gain[chosen] = 0.0
        pick = int(gain.argmax())
        first = max(first, float(gain[pick]))
        if gain[pick] <= _LEAST_GAIN * first:
            break
        chosen.append(pick)
        left *= _LEFT_OVER ** worth[pick]
        spread *= 1.0 - _SAME_DIRECTION * np.clip(directions @ directions[pick], 0.0, 1.0)
    return chosen
