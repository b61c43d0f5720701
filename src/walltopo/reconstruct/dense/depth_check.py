"""Depths that several stereo pairs and other photos' depth maps confirm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.reconstruct.dense.depth_maps import DepthMap, intrinsics, seen_from

Floats = NDArray[np.float64]

Depth = NDArray[np.float32]

# One standard deviation of a disparity, pixels, where stereo works at all.
_DISPARITY_SIGMA = 0.5

# Depths agree when they differ by less than this many joint standard deviations.
_TOLERANCE = 3.0

# Maps that must lie within tolerance of each other, where as many have a say.
_AGREE = 2

# A pair matches nothing reliably this close to the partner's border, pixels: the squares that
# it compares, at half size, reach across it.
_BLIND = 16.0


@kernel
def _agree(
    begin: int,
    end: int,
    stack: Depth,
    precision: Floats,
    own: Floats,
    theirs: Floats,
    sizes: Floats,
    turns: Floats,
    agree: int,
    depth: Depth,
    weight: Depth,
    support: NDArray[np.uint8],
) -> None:
    """Fill rows of depth, weight and support (in place)."""
    pairs, _, width = stack.shape
    tolerance = np.zeros((pairs, pairs))
    for one in range(pairs):
        for k in range(pairs):
            joint = np.sqrt(1.0 / precision[one] + 1.0 / precision[k])
            tolerance[one, k] = _TOLERANCE * joint
    for y in range(begin, end):
        for x in range(width):
            best = 0.0
            for candidate in range(pairs):
                z = stack[candidate, y, x]
                if np.isnan(z):
                    continue
                votes, against = 0, 0
                summed, total = 0.0, 0.0
                for k in range(pairs):
                    found = stack[k, y, x]
                    if np.isnan(found):
                        continue
                    if abs(found - z) < tolerance[candidate, k] * z * z:
                        votes += 1
                        summed += precision[k]
                        total += precision[k] * found
                    else:
                        u, v, _ = seen_from(x, y, z, own, theirs[k], turns[k])
                        right, bottom = sizes[k, 0] - _BLIND, sizes[k, 1] - _BLIND
                        if _BLIND <= u < right and _BLIND <= v < bottom:
                            against += 1
                if votes >= max(1, min(agree, votes + against)) and summed > best:
                    best = summed
                    depth[y, x] = total / summed
                    support[y, x] = votes
            if best > 0.0:
                weight[y, x] = best / depth[y, x] ** 4


def agreeing_depth(
    maps: Sequence[Depth], view: View, partners: Sequence[View]
) -> tuple[Depth, Depth, NDArray[np.uint8]]:
    """Merge several depth maps of one photo into the depth that most of them support.

    A pair whose partner does not see a spot finds something else there, if anything: it has no
    say about that spot. So the strip along a partner's border keeps the depth of the others.

    Parameters
    ----------
    maps : per stereo pair, (H, W) float32 z-depth, NaN where unknown.
    view : the photo's pinhole view.
    partners : the other photo's pinhole view of each pair; one farther off is more precise.

    Returns
    -------
    depth : (H, W) float32, 0 where too few agree.
    weight : (H, W) float32, inverse variance in 1 / world units squared, 0 where no depth.
    support : (H, W) uint8, how many maps agree on the depth, 0 where no depth.
    """
    here = np.eye(4)
    here[:3] = view.cam_from_world
    back = np.linalg.inv(here)
    baselines = np.array([np.linalg.norm(other.centre - view.centre) for other in partners])
    stack = np.stack(maps)
    depth, weight = np.zeros(stack.shape[1:], np.float32), np.zeros(stack.shape[1:], np.float32)
    support = np.zeros(stack.shape[1:], dtype=np.uint8)
    in_ranges(
        _agree,
        len(depth),
        stack,
        (view.camera.fx * baselines / _DISPARITY_SIGMA) ** 2,
        intrinsics(view),
        np.stack([intrinsics(other) for other in partners]),
        np.array([[other.camera.width, other.camera.height] for other in partners], dtype=float),
        np.stack([other.cam_from_world @ back for other in partners]),
        _AGREE,
        depth,
        weight,
        support,
    )
    return depth, weight, support


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
