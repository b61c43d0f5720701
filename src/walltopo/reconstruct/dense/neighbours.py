"""Which photos make good stereo pairs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.reconstruct.dense.scene import Scene

__all__ = ["choose_neighbours"]

Floats = NDArray[np.float64]

# Pairs that share fewer points than this say too little about their overlap.
_MIN_SHARED = 12
# Points that lie closer than this to the direction of the baseline cannot be rectified usefully.
_MIN_ASIDE = np.deg2rad(18.0)
# Width (natural logarithm) of the preference for the best angle.
_ANGLE_SPREAD = 0.55


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _pair_score(scene: Scene, i: int, j: int, shared: NDArray[np.int64], best: float) -> float:
    """Shared points, each weighted by how close its triangulation angle is to the best."""
    a, b = scene.views[i], scene.views[j]
    baseline = b.centre - a.centre
    length = float(np.linalg.norm(baseline))
    if length == 0 or float(a.direction @ b.direction) < 0.5:
        return 0.0
    rays_a = _unit(scene.points[shared] - a.centre)
    rays_b = _unit(scene.points[shared] - b.centre)
    forward = np.maximum(np.abs(rays_a @ baseline), np.abs(rays_b @ baseline)) / length
    aside = forward < np.cos(_MIN_ASIDE)
    angle = np.arccos(np.clip((rays_a * rays_b).sum(axis=1), -1.0, 1.0))
    offset = np.log(np.maximum(angle, 1e-4) / best) / _ANGLE_SPREAD
    return float(np.exp(-0.5 * offset[aside] ** 2).sum())


def choose_neighbours(scene: Scene, count: int, best_angle_deg: float) -> list[list[int]]:
    """Stereo partners of each view, best first.

    A partner should see much of the same surface under about the best angle; after the first,
    partners on another side of the photo are preferred, because they see behind other edges.

    Parameters
    ----------
    scene : views and points.
    count : partners wanted.
    best_angle_deg : triangulation angle preferred.

    Returns
    -------
    list per view of at most `count` indices of views; empty where nothing overlaps.
    """
    n = len(scene.views)
    best = float(np.deg2rad(best_angle_deg))
    visible = np.zeros((n, len(scene.points)), dtype=np.bool_)
    for k, seen in enumerate(scene.seen):
        visible[k, seen] = True
    scores = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1, n):
            shared = np.flatnonzero(visible[i] & visible[j])
            if len(shared) >= _MIN_SHARED:
                scores[i, j] = scores[j, i] = _pair_score(scene, i, j, shared, best)
    centres = np.array([view.centre for view in scene.views])
    return [_spread_choice(scores[i], centres - centres[i], count) for i in range(n)]


def _spread_choice(scores: Floats, offsets: Floats, count: int) -> list[int]:
    """Greedy choice by score, less for a direction that is already taken."""
    lengths = np.linalg.norm(offsets, axis=1, keepdims=True)
    directions = offsets / np.where(lengths > 0, lengths, 1.0)
    remaining = np.where(scores > 0.05 * scores.max(initial=0.0), scores, 0.0)
    chosen: list[int] = []
    while len(chosen) < count and remaining.max(initial=0.0) > 0:
        pick = int(remaining.argmax())
        chosen.append(pick)
        remaining[pick] = 0.0
        remaining *= 1.0 - 0.5 * np.clip(directions @ directions[pick], 0.0, 1.0)
    return chosen
