"""Depths that other photos' depth maps confirm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.dense.depth import DepthMap, intrinsics, seen_from
from walltopo.kernels import in_ranges, kernel

__all__ = ["confirmed"]

Floats = NDArray[np.float64]
Depth = NDArray[np.float32]

# Depths agree when they differ by less than this many joint standard deviations, and another
# photo sees through a point when its depth is farther by more than this.
_TOLERANCE = 3.0


@kernel
def _vote(
    begin: int,
    end: int,
    depth: Depth,
    weight: Depth,
    other: Depth,
    other_weight: Depth,
    k_here: Floats,
    k_there: Floats,
    there_from_here: Floats,
    sigma: float,
    votes: NDArray[np.int8],
) -> None:
    """Add one for each pixel that the other map confirms, take one where it sees through."""
    width = depth.shape[1]
    rows, columns = other.shape
    for y in range(begin, end):
        for x in range(width):
            z = depth[y, x]
            if z <= 0.0:
                continue
            right, down, qz = seen_from(x, y, z, k_here, k_there, there_from_here)
            if qz <= 0.0:
                continue
            u, v = int(np.floor(right)), int(np.floor(down))
            if u < 0 or v < 0 or u >= columns or v >= rows:
                continue
            found = other[v, u]
            if found <= 0.0:
                continue
            tolerance = _TOLERANCE * sigma * np.sqrt(1.0 / weight[y, x] + 1.0 / other_weight[v, u])
            if abs(found - qz) < tolerance:
                votes[y, x] += 1
            elif found > qz + tolerance:
                votes[y, x] -= 1


def confirmed(
    index: int, maps: Sequence[DepthMap], partners: Sequence[int], sigma: float, unless_pairs: int
) -> DepthMap:
    """A depth map without the pixels that the other maps speak against, or do not confirm.

    A pixel has one vote for each other map that holds the same surface there, less one for each
    that sees through it. It needs one vote, or none where enough of its own stereo pairs agree.

    Parameters
    ----------
    index : which of `maps`.
    maps : of each photo.
    partners : the maps to ask.
    sigma : standard deviation of a depth of weight 1, world units.
    unless_pairs : from so many stereo pairs on, a depth need only not be outvoted; 0: none need.
    """
    own = maps[index]
    here = np.eye(4)
    here[:3] = own.view.cam_from_world
    back = np.linalg.inv(here)
    votes = np.zeros(own.depth.shape, dtype=np.int8)
    for j in partners:
        other = maps[j]
        in_ranges(
            _vote,
            len(votes),
            own.depth,
            own.weight,
            other.depth,
            other.weight,
            intrinsics(own.view),
            intrinsics(other.view),
            np.ascontiguousarray(other.view.cam_from_world @ back),
            sigma,
            votes,
        )
    keep = votes >= np.where(own.pairs >= unless_pairs, 0, 1)
    return replace(own, depth=np.where(keep, own.depth, 0.0).astype(np.float32))
