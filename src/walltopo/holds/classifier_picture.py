"""The square picture of a hold that classifiers see, in training and in a scan alike."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError

__all__ = ["square"]

GREY = 114  # around the hold
FILLED = 0.9  # share of the side that the hold's longest extent takes


def square(crop: NDArray[np.uint8], mask: NDArray[np.bool_], side: int) -> NDArray[np.uint8]:
    """(side, side, 3) uint8: the masked pixels in the middle, scaled to fill it, grey around.

    Parameters
    ----------
    crop : (h, w, 3) uint8 RGB; mask : (h, w) bool, at least one pixel.

    Raises
    ------
    InputError : the mask is empty or of another shape.
    """
    import cv2

    if crop.shape[:2] != mask.shape:
        raise InputError(f"cutout: crop of {crop.shape[:2]}, but mask of {mask.shape}")
    rows, columns = np.nonzero(mask)
    if len(rows) == 0:
        raise InputError("cutout: the mask is empty")
    box = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    cover = mask[box].astype(np.float32)
    factor = FILLED * side / max(cover.shape)
    size = (max(1, round(cover.shape[1] * factor)), max(1, round(cover.shape[0] * factor)))
    method = cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR
    inner = cv2.resize(np.ascontiguousarray(crop[box]), size, interpolation=method)
    share = cv2.resize(cover, size, interpolation=method)[..., None]
    canvas = np.full((side, side, 3), GREY, np.uint8)
    top, left = (side - size[1]) // 2, (side - size[0]) // 2
    blended = inner * share + GREY * (1 - share)
    canvas[top : top + size[1], left : left + size[0]] = np.round(blended)
    return canvas
