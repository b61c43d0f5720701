"""One depth map of a photo from those of its stereo pairs: what most of them support."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.dense.depth import intrinsics, seen_from
from walltopo.kernels import in_ranges, kernel

__all__ = ["agreeing_depth"]

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
