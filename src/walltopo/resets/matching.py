"""Which hold of one scan is which of another scan of the same wall: by position and shape."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import Hold

__all__ = ["match_holds"]

Floats = NDArray[np.float64]

# Radius of the search in metres, round by round: the first rounds find how the second scan lies
# against the first (a drift of the measure, a bent corner), the last one decides.
RADII = (0.30, 0.15, 0.10)
SIZE_RATIO = 1.6  # the same hold measures within this factor in both scans
TURN_LIMIT_DEG = 35.0  # and the wall under it has turned by no more than this
MIN_FIT = 6  # pairs needed to believe in a shift of the whole scan


def _cost(old: Sequence[Hold], new: Sequence[Hold], points: Floats, radius: float) -> Floats:
    """(n, m) distance plus a penalty for shape, inf where the pair is impossible."""
    here = np.array([hold.position for hold in old]).reshape(-1, 1, 3)
    distance = np.linalg.norm(here - points[None], axis=2)
    sizes = [np.log(np.maximum([hold.size for hold in side], 1e-6)) for side in (old, new)]
    change = np.abs(sizes[0][:, None] - sizes[1][None])
    normals = [np.array([hold.normal for hold in side]).reshape(-1, 3) for side in (old, new)]
    facing = normals[0] @ normals[1].T
    kinds = np.array([[a.kind == b.kind for b in new] for a in old]).reshape(distance.shape)
    possible = (distance < radius) & (change < np.log(SIZE_RATIO)) & kinds
    possible &= facing > np.cos(np.radians(TURN_LIMIT_DEG))
    return np.where(possible, distance + 0.2 * radius * change, np.inf)


def _assign(cost: Floats) -> list[tuple[int, int]]:
    """One-to-one pairs of least total cost; impossible pairs are never made."""
    from scipy.optimize import linear_sum_assignment

    if not np.isfinite(cost).any():
        return []
    # Dearer than all possible pairs together, also where all of them cost nothing.
    dear = (float(cost[np.isfinite(cost)].max()) + 1.0) * (sum(cost.shape) + 1)
    rows, columns = linear_sum_assignment(np.where(np.isfinite(cost), cost, dear))
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return [(a, b) for a, b in pairs if np.isfinite(cost[a, b])]


def _rigid(source: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Rotation and shift that bring `source` onto `target` with least squares (Kabsch)."""
    middle_s, middle_t = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((source - middle_s).T @ (target - middle_t))
    sign = np.sign(np.linalg.det(u @ vt))
    rotation = (u @ np.diag([1.0, 1.0, sign]) @ vt).T
    return rotation, middle_t - rotation @ middle_s


def match_holds(old: Sequence[Hold], new: Sequence[Hold], unit: float = 1.0) -> dict[int, int]:
    """Match the holds of two scans that share a frame (up to a drift of some 20 cm).

    Colour is not looked at: paint fades, palettes are renamed.

    Parameters
    ----------
    old, new : holds; unit : scan units a metre (1 for scaled scans).

    Returns
    -------
    Old id to new id, one-to-one.
    """
    if not old or not new:
        return {}
    points = np.array([hold.position for hold in new])
    base = np.array([hold.position for hold in old])
    pairs: list[tuple[int, int]] = []
    for radius in RADII:
        pairs = _assign(_cost(old, new, points, radius * unit))
        if len(pairs) >= MIN_FIT:
            rows, columns = (list(side) for side in zip(*pairs, strict=True))
            rotation, shift = _rigid(points[columns], base[rows])
            points = points @ rotation.T + shift
    return {old[a].id: new[b].id for a, b in pairs}
