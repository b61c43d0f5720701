"""The label image of a view as the fast method draws it: reused, and only touched near masks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.kernels import kernel
from walltopo.lifting.border import STEPS, reach_of, stamp_borders
from walltopo.lifting.labels import label_size, resized_mask

__all__ = ["Canvas", "mask_windows"]

Ints = NDArray[np.int32]


class Canvas:
    """Images of one worker: masks, and distances to their borders.

    Filling whole images for each view would cost more than drawing the masks; `draw` therefore
    cleans up behind the view before and nothing else.

    Attributes
    ----------
    code : (h, w) int32 and distance : (h, w) uint8, as told at `border.stamp_borders`.
    """

    def __init__(self) -> None:
        self._labels = np.zeros((0, 0), dtype=np.int32)
        self.code = self._labels
        self.distance = np.zeros((0, 0), dtype=np.uint8)
        self._dirty = np.zeros((0, 4), dtype=np.int32)
        self._full = 0

    def draw(self, view: View, order: list[int], mask_resolution: int, band: float) -> None:
        """Draw the masks of a view in this order, later ones on top; see `labels.draw_labels`."""
        width, height = label_size(view, mask_resolution)
        self._clean((height, width), round(band * STEPS))
        reach = reach_of(band)
        boxes = np.zeros((len(order), 5), dtype=np.int32)
        for row, index in enumerate(order):
            x, y, bitmap = resized_mask(view.masks[index], width, height)
            # A copy: kernels are compiled anew for arrays in other orders, or of others' memory.
            _paint(self._labels, self.code, np.array(bitmap, order="C"), x, y, index)
            boxes[row] = index, y, y + bitmap.shape[0], x, x + bitmap.shape[1]
        if band > 0:
            stamp_borders(self._labels, boxes, reach, self.code, self.distance)
        self._dirty = boxes[:, 1:] + np.array([-reach, reach, -reach, reach], dtype=np.int32)

    def _clean(self, shape: tuple[int, int], full: int) -> None:
        if self._labels.shape != shape or self._full != full:
            self._labels = np.full(shape, -1, dtype=np.int32)
            self.code = self._labels.copy()
            self.distance = np.full(shape, full, dtype=np.uint8)
            self._full = full
        else:
            _wipe(self._labels, self.code, self.distance, self._dirty, full)


@kernel
def _paint(labels: Any, code: Any, bitmap: Any, x: Any, y: Any, index: Any) -> None:
    for row in range(bitmap.shape[0]):
        for col in range(bitmap.shape[1]):
            if bitmap[row, col]:
                labels[y + row, x + col] = code[y + row, x + col] = index


@kernel
def _wipe(labels: Any, code: Any, distance: Any, boxes: Any, full: Any) -> None:
    """Take off what lies in boxes of first and end row, first and end column."""
    for box in boxes:
        for row in range(max(box[0], 0), min(box[1], labels.shape[0])):
            for col in range(max(box[2], 0), min(box[3], labels.shape[1])):
                labels[row, col] = code[row, col] = -1
                distance[row, col] = full


def mask_windows(view: View, order: list[int], cell: int) -> NDArray[np.int64]:
    """Where masks may lie: a summed-area table over cells of the photo.

    Parameters
    ----------
    cell : side of a cell, pixels of the photo.

    Returns
    -------
    (rows + 1, cols + 1) int64, number of cells touched by a mask's box above and left of each
    corner.
    """
    rows, cols = view.camera.height // cell + 1, view.camera.width // cell + 1
    touched = np.zeros((rows, cols), dtype=np.int64)
    for index in order:
        mask = view.masks[index]
        h, w = mask.bitmap.shape
        fx, fy = view.camera.width / mask.width / cell, view.camera.height / mask.height / cell
        # One cell of margin: masks of another size are moved by up to a pixel when resized.
        top, bottom = int(mask.y * fy) - 1, int((mask.y + h) * fy) + 2
        left, right = int(mask.x * fx) - 1, int((mask.x + w) * fx) + 2
        touched[max(0, top) : bottom, max(0, left) : right] = 1
    table = np.zeros((rows + 1, cols + 1), dtype=np.int64)
    table[1:, 1:] = touched.cumsum(axis=0).cumsum(axis=1)
    return table
