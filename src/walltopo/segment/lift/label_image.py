"""The label image of a view: which mask lies on top at each pixel, and how near its border is."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, View
from walltopo.geometry.kernels import kernel
from walltopo.segment.lift.settings import OnTop

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


# Distances are stored in these parts of a pixel.
STEPS = 16


def reach_of(band: float) -> int:
    """How many pixels away a border pixel can matter."""
    return int(np.ceil(band + 0.5)) if band > 0 else 0


@kernel
def stamp_borders(labels: Any, boxes: Any, reach: Any, code: Any, distance: Any) -> None:
    """Let every border pixel of the masks tell its surroundings how far away they are.

    Parameters
    ----------
    labels : (h, w) int32, mask index, -1 = none.
    boxes : (n, 5) int32: mask index and its first row, end row, first column, end column.
    reach : see `reach_of`.
    code : (h, w) int32, holds `labels`; becomes -2 - index on no mask but near that one, the
        nearest.
    distance : (h, w) uint8, holds the band in 1/16 px; becomes the distance to the border of
        the pixel's own or nearest mask where that is less. The photo's edge is no border.
    """
    rows, cols = labels.shape
    size = 2 * reach + 1
    inner, outer = np.zeros((size, size)), np.zeros((size, size))
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            length = np.sqrt(float(dy * dy + dx * dx))
            # The border runs between two pixels' centres, half a pixel from each.
            inner[dy + reach, dx + reach] = (length + 0.5) * STEPS
            outer[dy + reach, dx + reach] = max(length - 0.5, 0.0) * STEPS
    for box in range(len(boxes)):
        label = boxes[box, 0]
        for row in range(boxes[box, 1], boxes[box, 2]):
            for col in range(boxes[box, 3], boxes[box, 4]):
                if labels[row, col] != label:
                    continue
                edge = row > 0 and labels[row - 1, col] != label
                edge |= row < rows - 1 and labels[row + 1, col] != label
                edge |= col > 0 and labels[row, col - 1] != label
                edge |= col < cols - 1 and labels[row, col + 1] != label
                if not edge:
                    continue
                for y in range(max(0, row - reach), min(rows, row + reach + 1)):
                    for x in range(max(0, col - reach), min(cols, col + reach + 1)):
                        there = labels[y, x]
                        if there == label:
                            value = inner[y - row + reach, x - col + reach]
                            if value < distance[y, x]:
                                distance[y, x] = np.uint8(value)
                        elif there == -1:
                            value = outer[y - row + reach, x - col + reach]
                            if value < distance[y, x]:
                                distance[y, x] = np.uint8(value)
                                code[y, x] = -2 - label
