"""Match the holds of two scans of the same wall by position and shape.

First the second scan is aligned with the first. Then each pair is tested: is it more likely one
hold, or two different holds at about the same place? Sockets are few and holds come in standard
sizes, so chance pairs are not rare. The share of holds (and of volumes) that stayed is estimated
from all pairs together, by expectation maximisation of the mixture's weight (A. Dempster et al.,
1977, section 4.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.similarity import nearest_rotation
from walltopo.scans.holds import Hold

Floats = NDArray[np.float64]

# Search radius in metres, round by round, for the alignment of the second scan with the first (for
# a drift of the scale, or a bent corner).
RADII: Final = (0.30, 0.15, 0.10)
SIZE_RATIO: Final = 2.0  # maximum ratio of the sizes of one hold in both scans
TURN_LIMIT_DEG: Final = 35.0  # maximum angle between the normals of one hold in both scans
MIN_FIT: Final = 6  # minimum number of pairs for a rigid transform, which has six parameters

# Differences between two scans of one hold, on a generated gym of which half was reset. Most pairs
# are close, some are not (a hold that is half hidden in one scan): a share and two spreads each, of
# the distance in metres (per direction) and of the size (logarithm of the ratio).
_SAME_SHARE: Final = 0.9
_SAME_NEAR: Final = 0.004
_SAME_FAR: Final = 0.02
_SAME_SIZE: Final = 0.04
_SAME_SIZE_FAR: Final = 0.25
# Differences between a hold and its replacement: a share in the same socket, the rest anywhere.
_SOCKET_SHARE: Final = 0.1
_SOCKET: Final = 0.012
_OTHER_SIZE: Final = 0.6
_AROUND: Final = 1.0  # metres: radius in which other holds are counted
_ROUNDS: Final = 30


def _plausible_pairs(old: Sequence[Hold], new: Sequence[Hold]) -> tuple[NDArray[np.bool_], Floats]:
    """Return (n, m) whether kind, size and normal allow a pair, and the log ratio of the sizes."""
    sizes = [np.log(np.maximum([hold.size for hold in side], 1e-6)) for side in (old, new)]
    change = np.abs(sizes[0][:, None] - sizes[1][None])
    normals = [np.array([hold.normal for hold in side]).reshape(-1, 3) for side in (old, new)]
    facing = normals[0] @ normals[1].T
    kinds = np.array([[a.kind == b.kind for b in new] for a in old]).reshape(change.shape)
    plausible = kinds & (change < np.log(SIZE_RATIO))
    return plausible & (facing > np.cos(np.radians(TURN_LIMIT_DEG))), change


def _distances(base: Floats, points: Floats) -> Floats:
    return np.linalg.norm(base[:, None] - points[None], axis=2)


def _assign_pairs(cost: Floats) -> list[tuple[int, int]]:
    """Return one-to-one pairs of minimum total cost, without pairs of infinite cost."""
    from scipy.optimize import linear_sum_assignment

    if not np.isfinite(cost).any():
        return []
    # This cost exceeds that of all finite pairs together, even if they all cost nothing.
    prohibitive = (float(cost[np.isfinite(cost)].max()) + 1.0) * (sum(cost.shape) + 1)
    rows, columns = linear_sum_assignment(np.where(np.isfinite(cost), cost, prohibitive))
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return [(a, b) for a, b in pairs if np.isfinite(cost[a, b])]


def _fit_rigid_motion(source: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Return rotation and translation from `source` to `target` by least squares (Kabsch)."""
    middle_s, middle_t = source.mean(axis=0), target.mean(axis=0)
    rotation = nearest_rotation((target - middle_t).T @ (source - middle_s))
    return rotation, middle_t - rotation @ middle_s


def _align_positions(
    base: Floats, points: Floats, plausible: NDArray[np.bool_], change: Floats, unit: float
) -> Floats:
    """Return the positions of the second scan, aligned with the first if that improves the match.

    A fit to chance pairs also brings some of them together. The transform is therefore accepted
    only if the number of close pairs grows by at least its number of parameters.
    """
    moved = points
    for radius in RADII:
        distance = _distances(base, moved)
        near = plausible & (distance < radius * unit)
        pairs = _assign_pairs(np.where(near, distance + 0.2 * radius * unit * change, np.inf))
        if len(pairs) >= MIN_FIT:
            rows, columns = (list(side) for side in zip(*pairs, strict=True))
            rotation, shift = _fit_rigid_motion(moved[columns], base[rows])
            moved = moved @ rotation.T + shift
    close = _SAME_FAR * unit
    before, after = (
        len(_assign_pairs(np.where(plausible & (distance < close), distance, np.inf)))
        for distance in (_distances(base, points), _distances(base, moved))
    )
    return moved if after >= before + MIN_FIT else points


def _log_likelihood_ratio(distance: Floats, change: Floats, density: Floats) -> Floats:
    """Return the log likelihood ratio of each pair: one hold against two different holds.

    Parameters
    ----------
    distance : (n, m) metres; change : (n, m) logarithm of the ratio of sizes.
    density : (n, 1) number of other holds per square metre around each.
    """
    same = _SAME_SHARE * _rayleigh_density(distance, _SAME_NEAR)
    same += (1.0 - _SAME_SHARE) * _rayleigh_density(distance, _SAME_FAR)
    anywhere = 2.0 * np.pi * density * distance
    other = _SOCKET_SHARE * _rayleigh_density(distance, _SOCKET) + (1.0 - _SOCKET_SHARE) * anywhere
    size = _SAME_SHARE * _half_normal_density(change, _SAME_SIZE)
    size += (1.0 - _SAME_SHARE) * _half_normal_density(change, _SAME_SIZE_FAR)
    tiny = np.finfo(np.float64).tiny
    return (
        np.log(same + tiny)
        - np.log(other + tiny)
        + np.log(size / _half_normal_density(change, _OTHER_SIZE))
    )


def _rayleigh_density(distance: Floats, spread: float) -> Floats:
    """Return the density of the length of a 2D vector with normally distributed components."""
    return distance / spread**2 * np.exp(-0.5 * (distance / spread) ** 2)


def _half_normal_density(value: Floats, spread: float) -> Floats:
    """Return the density of a normally distributed absolute value, up to a common factor."""
    return np.exp(-0.5 * (value / spread) ** 2) / spread


def _more_likely_same(evidence: Floats, max_pairs: int) -> NDArray[np.bool_]:
    """Return which pairs are more likely one hold than two, given the share that stayed.

    Parameters
    ----------
    evidence : log likelihood ratio of each pair; max_pairs : maximum number of pairs.
    """
    share = 0.5
    posterior = np.zeros_like(evidence)
    for _ in range(_ROUNDS):
        odds = evidence + np.log(share / (1.0 - share))
        posterior = 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))
        # Laplace smoothing keeps the share away from 0 and 1.
        share = (float(posterior.sum()) + 1.0) / (max_pairs + 2.0)
    return posterior > 0.5


def match_holds(old: Sequence[Hold], new: Sequence[Hold], unit: float = 1.0) -> dict[int, int]:
    """Return the matched holds of two scans that share a frame (up to a drift of some 20 cm).

    Colour is ignored, because paint fades and palettes are renamed.

    Parameters
    ----------
    old, new : holds; unit : scan units per metre (1 for scaled scans).

    Returns
    -------
    Old id to new id, one-to-one.
    """
    if not old or not new:
        return {}
    plausible, change = _plausible_pairs(old, new)
    base = np.array([hold.position for hold in old])
    points = np.array([hold.position for hold in new])
    points = _align_positions(base, points, plausible, change, unit)
    distance = _distances(base, points) / unit
    density = (distance < _AROUND).sum(axis=1, keepdims=True) / (np.pi * _AROUND**2)
    # Distances below a tenth of a millimetre carry no more evidence.
    evidence = _log_likelihood_ratio(np.maximum(distance, 1e-4), change, np.maximum(density, 1e-3))
    near = plausible & (distance < RADII[-1])
    # The assignment needs costs >= 0.
    cost = np.where(near, -evidence, np.inf)
    if not near.any():
        return {}
    pairs = _assign_pairs(cost - cost[near].min())
    same: dict[int, int] = {}
    # Volumes stay through more resets than holds do, so each kind has its own share.
    for kind in {hold.kind for hold in old}:
        mine = [(a, b) for a, b in pairs if old[a].kind == kind]
        max_pairs = min(sum(hold.kind == kind for hold in side) for side in (old, new))
        accepted = _more_likely_same(np.array([evidence[pair] for pair in mine]), max_pairs)
        same |= {
            old[a].id: new[b].id for (a, b), is_one in zip(mine, accepted, strict=True) if is_one
        }
    return same
