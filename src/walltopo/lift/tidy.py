"""Masks of one view before they are projected: duplicates out, small ones on top."""

from __future__ import annotations

import numpy as np

from walltopo.core import Mask, View

__all__ = ["tidy_order"]

# Two masks of one view that overlap this much show the same object twice.
SAME = 0.7


def tidy_order(view: View, drop_duplicates: bool) -> list[int]:
    """The order of drawing: the largest first, so that what lies on something stays visible.

    A mask over two objects, one of which has a mask of its own, thereby loses that part. Of
    masks that show the same object twice (IoU of 0.7) the one with the lower score is left out.
    """
    masks = view.masks
    areas = [mask.area for mask in masks]
    order = [k for k in range(len(masks)) if areas[k] > 0]
    if drop_duplicates:
        order = _without_duplicates(masks, areas, order)
    return sorted(order, key=lambda k: (-areas[k], masks[k].score, k))


def _without_duplicates(masks: tuple[Mask, ...], areas: list[int], order: list[int]) -> list[int]:
    boxes = np.array([masks[k].box for k in order], dtype=np.int64).reshape(-1, 4)
    size = np.array([areas[k] for k in order], dtype=np.float64)
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    kept: list[int] = []  # positions in `order`
    for n in sorted(range(len(order)), key=lambda n: (-masks[order[n]].score, order[n])):
        others = np.array(kept, dtype=np.int64)
        both = np.minimum(high[others], high[n]) - np.maximum(low[others], low[n])
        most = np.where((both > 0).all(axis=1), both.prod(axis=1), 0)
        most = np.minimum(most, np.minimum(size[others], size[n]))
        # The boxes bound the overlap: few pairs are worth counting pixels.
        near = others[most >= SAME * (size[others] + size[n] - most)]
        if not any(_iou(masks[order[n]], masks[order[m]]) >= SAME for m in near):
            kept.append(n)
    return [order[n] for n in kept]


def _iou(one: Mask, other: Mask) -> float:
    if (one.width, one.height) != (other.width, other.height):
        return 0.0
    x0, y0 = max(one.x, other.x), max(one.y, other.y)
    x1 = min(one.x + one.bitmap.shape[1], other.x + other.bitmap.shape[1])
    y1 = min(one.y + one.bitmap.shape[0], other.y + other.bitmap.shape[0])
    if x1 <= x0 or y1 <= y0:
        return 0.0
    mine = one.bitmap[y0 - one.y : y1 - one.y, x0 - one.x : x1 - one.x]
    theirs = other.bitmap[y0 - other.y : y1 - other.y, x0 - other.x : x1 - other.x]
    both = int(np.count_nonzero(mine & theirs))
    return both / (one.area + other.area - both)
