"""Masks of one view before they are projected: duplicates out."""

from __future__ import annotations

import numpy as np

from walltopo.core import Mask, View
from walltopo.segment.lift.label_image import drawing_order
from walltopo.segment.lift.settings import OnTop

# Two masks of one view that overlap this much show the same object twice.
SAME = 0.7


def tidy_order(view: View, on_top: OnTop, drop_duplicates: bool) -> list[int]:
    """The order of drawing; of masks that show the same object twice only the surer one."""
    masks = view.masks
    order = drawing_order(view, on_top)
    if drop_duplicates:
        order = _without_duplicates(masks, [mask.area for mask in masks], order)
    return order


def _without_duplicates(masks: tuple[Mask, ...], areas: list[int], order: list[int]) -> list[int]:
    """Drop the less certain of masks that show the same; the others in their order."""
    # Boxes of the same object have centres closer than the largest box: a hash finds them.
    cell = max((max(masks[k].bitmap.shape) for k in order), default=1)
    table: dict[tuple[int, int], list[int]] = {}
    dropped = set()
    for k in sorted(order, key=lambda k: (-masks[k].score, k)):
        x, y, w, h = masks[k].box
        col, row = (2 * x + w) // (2 * cell), (2 * y + h) // (2 * cell)
        near = [
            other
            for dx in (-1, 0, 1)
            for dy in (-1, 0, 1)
            for other in table.get((col + dx, row + dy), ())
        ]
        if any(_same(masks[k], masks[other], areas[k], areas[other]) for other in near):
            dropped.add(k)
        else:
            table.setdefault((col, row), []).append(k)
    return [k for k in order if k not in dropped]


def _same(one: Mask, other: Mask, area: int, other_area: int) -> bool:
    """Do two masks overlap by `SAME`? Sizes and boxes bound the overlap before pixels count."""
    if (one.width, one.height) != (other.width, other.height):
        return False
    x0, y0 = max(one.x, other.x), max(one.y, other.y)
    x1 = min(one.x + one.bitmap.shape[1], other.x + other.bitmap.shape[1])
    y1 = min(one.y + one.bitmap.shape[0], other.y + other.bitmap.shape[0])
    if x1 <= x0 or y1 <= y0:
        return False
    most = min((x1 - x0) * (y1 - y0), area, other_area)
    if most < SAME * (area + other_area - most):
        return False
    mine = one.bitmap[y0 - one.y : y1 - one.y, x0 - one.x : x1 - one.x]
    theirs = other.bitmap[y0 - other.y : y1 - other.y, x0 - other.x : x1 - other.x]
    both = int(np.count_nonzero(mine & theirs))
    return both >= SAME * (area + other_area - both)
