"""The label image of one view: which mask lies on each pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, View
from walltopo.lifting.contract import OnTop

__all__ = ["draw_labels", "drawing_order", "label_size", "resized_mask"]


def label_size(view: View, mask_resolution: int) -> tuple[int, int]:
    """Width and height of the label image of a view.

    With `mask_resolution` 0 it is the size of the masks (the largest, where they differ), or of
    the photo where there are none; otherwise its longer side, in the photo's proportions.
    """
    if mask_resolution > 0:
        factor = mask_resolution / max(view.camera.width, view.camera.height)
        return (
            max(1, round(view.camera.width * factor)),
            max(1, round(view.camera.height * factor)),
        )
    if not view.masks:
        return view.camera.width, view.camera.height
    largest = max(view.masks, key=lambda mask: mask.width * mask.height)
    return largest.width, largest.height


def drawing_order(view: View, on_top: OnTop) -> list[int]:
    """The masks of a view that have pixels, in the order of drawing: later ones lie on top.

    The publication speaks of one image of masks a photo and of no order. With the smaller mask on
    top, what lies on something stays visible, and a mask over two objects, one of which has a mask
    of its own, loses that part.
    """
    masks = view.masks
    order = [k for k, mask in enumerate(masks) if mask.area > 0]
    if on_top == "surest":
        return sorted(order, key=lambda k: masks[k].score)
    return sorted(order, key=lambda k: (-masks[k].area, masks[k].score, k))


def draw_labels(view: View, order: list[int], mask_resolution: int) -> NDArray[np.int32]:
    """Draw the masks of a view, later ones over earlier ones.

    Parameters
    ----------
    order : indices into `view.masks`, in the order of drawing; masks left out are not drawn.

    Returns
    -------
    (h, w) int32, index of the mask on each pixel, -1 = none.
    """
    width, height = label_size(view, mask_resolution)
    image = np.full((height, width), -1, dtype=np.int32)
    for index in order:
        x, y, bitmap = resized_mask(view.masks[index], width, height)
        h, w = bitmap.shape
        image[y : y + h, x : x + w][bitmap] = index
    return image


def resized_mask(mask: Mask, width: int, height: int) -> tuple[int, int, NDArray[np.bool_]]:
    """A mask's bitmap in an image of another size (nearest pixel), and where it starts."""
    if (mask.width, mask.height) == (width, height) or mask.bitmap.size == 0:
        return mask.x, mask.y, mask.bitmap
    # Column c of the label image has its centre at (c + 0.5) * mask.width / width in the mask's.
    cols = ((np.arange(width) + 0.5) * mask.width / width).astype(np.int64) - mask.x
    rows = ((np.arange(height) + 0.5) * mask.height / height).astype(np.int64) - mask.y
    h, w = mask.bitmap.shape
    col = np.flatnonzero((cols >= 0) & (cols < w))
    row = np.flatnonzero((rows >= 0) & (rows < h))
    if len(col) == 0 or len(row) == 0:
        return 0, 0, np.zeros((0, 0), dtype=np.bool_)
    return int(col[0]), int(row[0]), mask.bitmap[np.ix_(rows[row], cols[col])]
