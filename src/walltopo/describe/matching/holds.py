"""Which hold of one scan is which of another scan of the same wall: by position and shape.

First how the second scan lies against the first, then, pair by pair, what is more likely: that it
is the same hold, or another one that was screwed to about the same place. Sockets are few and holds
come in sizes, so chance pairs are not rare; how many holds stayed, and how many volumes, is found
from all pairs together (expectation maximisation of the mixture's weight; A. Dempster et al., 1977,
section 4.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import Hold

Floats = NDArray[np.float64]

# Radius of the search in metres, round by round, for how the second scan lies against the first (a
# drift of the measure, a bent corner).
RADII: Final = (0.30, 0.15, 0.10)
SIZE_RATIO: Final = 2.0  # the same hold measures within this factor in both scans
TURN_LIMIT_DEG: Final = 35.0  # and the wall under it has turned by no more than this
MIN_FIT: Final = (
    6  # pairs needed to believe in a shift of the whole scan, which six numbers describe
)

# What two scans of one hold differ by, seen on a generated gym of which half was reset: most pairs
# are close, some are not (a hold half hidden in one scan). Each a share and two spreads, the
# distance in metres (of each of two directions), the size as logarithm of the ratio.
_SAME_SHARE: Final = 0.9
_SAME_NEAR: Final = 0.004
_SAME_FAR: Final = 0.02
_SAME_SIZE: Final = 0.04
_SAME_SIZE_FAR: Final = 0.25
# And two holds of which one replaced the other: that share in the same socket, the rest anywhere.
_SOCKET_SHARE: Final = 0.1
_SOCKET: Final = 0.012
_OTHER_SIZE: Final = 0.6
_AROUND: Final = 1.0  # metres around a hold in which others are counted
_ROUNDS: Final = 30


def _possible(old: Sequence[Hold], new: Sequence[Hold]) -> tuple[NDArray[np.bool_], Floats]:
    """(n, m) whether a pair can be one hold by kind, size and facing; change of size, logarithm."""
    sizes = [np.log(np.maximum([hold.size for hold in side], 1e-6)) for side in (old, new)]
    change = np.abs(sizes[0][:, None] - sizes[1][None])
    normals = [np.array([hold.normal for hold in side]).reshape(-1, 3) for side in (old, new)]
    facing = normals[0] @ normals[1].T
    kinds = np.array([[a.kind == b.kind for b in new] for a in old]).reshape(change.shape)
    possible = kinds & (change < np.log(SIZE_RATIO))
    return possible & (facing > np.cos(np.radians(TURN_LIMIT_DEG))), change


def _distances(base: Floats, points: Floats) -> Floats:
    return np.linalg.norm(base[:, None] - points[None], axis=2)


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


def _in_frame(base: Floats, points: Floats, possible: NDArray[np.bool_], change: Floats,
              unit: float) -> Floats:  # fmt: skip
    """The second scan's places, moved onto the first where that brings holds to their places.

    What is fitted to chance pairs brings some of them together, too: a move is believed where more
    pairs are close after it than before by as many as it has numbers.
    """
    moved = points
    for radius in RADII:
        distance = _distances(base, moved)
        near = possible & (distance < radius * unit)
        pairs = _assign(np.where(near, distance + 0.2 * radius * unit * change, np.inf))
        if len(pairs) >= MIN_FIT:
            rows, columns = (list(side) for side in zip(*pairs, strict=True))
            rotation, shift = _rigid(moved[columns], base[rows])
            moved = moved @ rotation.T + shift
    close = _SAME_FAR * unit
    before, after = (
        len(_assign(np.where(possible & (distance < close), distance, np.inf)))
        for distance in (_distances(base, points), _distances(base, moved))
    )
    return moved if after >= before + MIN_FIT else points


def _evidence(distance: Floats, change: Floats, density: Floats) -> Floats:
    """Logarithm of how much likelier each pair is of one hold than of two.

    Parameters
    ----------
    distance : (n, m) metres; change : (n, m) logarithm of the ratio of sizes.
    density : (n, 1) other holds a square metre around each.
    """
    same = _SAME_SHARE * _rayleigh(distance, _SAME_NEAR)
    same += (1.0 - _SAME_SHARE) * _rayleigh(distance, _SAME_FAR)
    anywhere = 2.0 * np.pi * density * distance
    other = _SOCKET_SHARE * _rayleigh(distance, _SOCKET) + (1.0 - _SOCKET_SHARE) * anywhere
    size = _SAME_SHARE * _normal(change, _SAME_SIZE)
    size += (1.0 - _SAME_SHARE) * _normal(change, _SAME_SIZE_FAR)
    tiny = np.finfo(np.float64).tiny
    return np.log(same + tiny) - np.log(other + tiny) + np.log(size / _normal(change, _OTHER_SIZE))


def _rayleigh(distance: Floats, spread: float) -> Floats:
    """Density of the length of a vector in the plane whose two parts are normal."""
    return distance / spread**2 * np.exp(-0.5 * (distance / spread) ** 2)


def _normal(value: Floats, spread: float) -> Floats:
    """Density of a normal value's amount, but for a factor that all have."""
    return np.exp(-0.5 * (value / spread) ** 2) / spread


def _likely(evidence: Floats, most: int) -> NDArray[np.bool_]:
    """Which pairs are more likely one hold than two, given how many seem to have stayed.

    Parameters
    ----------
    evidence : of each pair; most : pairs that there could be.
    """
    share = 0.5
    belief = np.zeros_like(evidence)
    for _ in range(_ROUNDS):
        odds = evidence + np.log(share / (1.0 - share))
        belief = 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))
        # One hold more that stayed, and one that did not, so that no share is quite none or all.
        share = (float(belief.sum()) + 1.0) / (most + 2.0)
    return belief > 0.5


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
    possible, change = _possible(old, new)
    base = np.array([hold.position for hold in old])
    points = np.array([hold.position for hold in new])
    points = _in_frame(base, points, possible, change, unit)
    distance = _distances(base, points) / unit
    density = (distance < _AROUND).sum(axis=1, keepdims=True) / (np.pi * _AROUND**2)
    # The same place to the last digit says no more than a tenth of a millimetre does.
    evidence = _evidence(np.maximum(distance, 1e-4), change, np.maximum(density, 1e-3))
    near = possible & (distance < RADII[-1])
    # The assignment wants costs: evidence against, from none on.
    against = np.where(near, -evidence, np.inf)
    if not near.any():
        return {}
    pairs = _assign(against - against[near].min())
    same: dict[int, int] = {}
    # Volumes stay through more resets than holds do: each kind has its own share.
    for kind in {hold.kind for hold in old}:
        mine = [(a, b) for a, b in pairs if old[a].kind == kind]
        most = min(sum(hold.kind == kind for hold in side) for side in (old, new))
        likely = _likely(np.array([evidence[pair] for pair in mine]), most)
        same |= {
            old[a].id: new[b].id for (a, b), is_one in zip(mine, likely, strict=True) if is_one
        }
    return same
