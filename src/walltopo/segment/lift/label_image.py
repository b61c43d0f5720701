"""The label image of a view (the topmost mask at each pixel), and the table of all views."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, View
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.segment.lift.settings import OnTop

Ints = NDArray[np.int32]


class Canvas:
    """The label image of a view, and distances to mask borders, in reused buffers.

    Clearing whole images for each view would cost more than drawing the masks, so `draw` clears
    only the pixels that the previous view drew.

    Attributes
    ----------
    code : (h, w) int32 and distance : (h, w) uint8, see `stamp_borders`.
    """

    def __init__(self) -> None:
        self._labels = np.zeros((0, 0), dtype=np.int32)
        self.code = self._labels
        self.distance = np.zeros((0, 0), dtype=np.uint8)
        self._dirty = np.zeros((0, 4), dtype=np.int32)
        self._background = 0

    def draw(self, view: View, order: list[int], mask_resolution: int, band: float) -> None:
        """Draw the masks of a view in this order, later ones on top; see `draw_labels`."""
        width, height = label_size(view, mask_resolution)
        self._clean((height, width), round(band * STEPS))
        reach = reach_of(band)
        boxes = np.zeros((len(order), 5), dtype=np.int32)
        for row, index in enumerate(order):
            x, y, bitmap = resized_mask(view.masks[index], width, height)
            # Copy: kernels are compiled anew for other memory orders and for read-only arrays.
            _paint(self._labels, self.code, np.array(bitmap, order="C"), x, y, index)
            boxes[row] = index, y, y + bitmap.shape[0], x, x + bitmap.shape[1]
        if band > 0:
            stamp_borders(self._labels, boxes, reach, self.code, self.distance)
        self._dirty = boxes[:, 1:] + np.array([-reach, reach, -reach, reach], dtype=np.int32)

    def _clean(self, shape: tuple[int, int], background: int) -> None:
        if self._labels.shape != shape or self._background != background:
            self._labels = np.full(shape, -1, dtype=np.int32)
            self.code = self._labels.copy()
            self.distance = np.full(shape, background, dtype=np.uint8)
            self._background = background
        else:
            _wipe(self._labels, self.code, self.distance, self._dirty, background)


@kernel
def _paint(labels: Any, code: Any, bitmap: Any, x: Any, y: Any, index: Any) -> None:
    for row in range(bitmap.shape[0]):
        for col in range(bitmap.shape[1]):
            if bitmap[row, col]:
                labels[y + row, x + col] = code[y + row, x + col] = index


@kernel
def _wipe(labels: Any, code: Any, distance: Any, boxes: Any, background: Any) -> None:
    """Reset the pixels in boxes of (first row, end row, first column, end column)."""
    for box in boxes:
        for row in range(max(box[0], 0), min(box[1], labels.shape[0])):
            for col in range(max(box[2], 0), min(box[3], labels.shape[1])):
                labels[row, col] = code[row, col] = -1
                distance[row, col] = background


def mask_windows(view: View, order: list[int], cell: int) -> NDArray[np.int64]:
    """Return a summed-area table of the photo's cells that the boxes of masks touch.

    Parameters
    ----------
    cell : side of a cell, pixels of the photo.

    Returns
    -------
    (rows + 1, cols + 1) int64, number of touched cells above and left of each corner.
    """
    rows, cols = view.camera.height // cell + 1, view.camera.width // cell + 1
    touched = np.zeros((rows, cols), dtype=np.int64)
    for index in order:
        mask = view.masks[index]
        h, w = mask.bitmap.shape
        fx, fy = view.camera.width / mask.width / cell, view.camera.height / mask.height / cell
        # One cell of margin: resizing moves a mask by up to a pixel.
        top, bottom = int(mask.y * fy) - 1, int((mask.y + h) * fy) + 2
        left, right = int(mask.x * fx) - 1, int((mask.x + w) * fx) + 2
        touched[max(0, top) : bottom, max(0, left) : right] = 1
    table = np.zeros((rows + 1, cols + 1), dtype=np.int64)
    table[1:, 1:] = touched.cumsum(axis=0).cumsum(axis=1)
    return table


def label_size(view: View, mask_resolution: int) -> tuple[int, int]:
    """Return width and height of the label image of a view.

    If `mask_resolution` is 0, the size is that of the largest mask, or of the photo if the view
    has no masks. Otherwise `mask_resolution` is the longer side, in the photo's proportions.
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
    """Return the indices of the non-empty masks in drawing order: later ones lie on top.

    The publication has one mask image per photo and defines no order. With the smaller mask on
    top, an object that lies on another stays visible. A mask that wrongly covers two objects loses
    the one that has its own mask.
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
    order : indices into `view.masks` in drawing order; other masks are not drawn.

    Returns
    -------
    (h, w) int32, index of the mask at each pixel, -1 = none.
    """
    width, height = label_size(view, mask_resolution)
    image = np.full((height, width), -1, dtype=np.int32)
    for index in order:
        x, y, bitmap = resized_mask(view.masks[index], width, height)
        h, w = bitmap.shape
        image[y : y + h, x : x + w][bitmap] = index
    return image


def resized_mask(mask: Mask, width: int, height: int) -> tuple[int, int, NDArray[np.bool_]]:
    """Return a mask resampled (nearest pixel) to an image of another size: x, y and bitmap."""
    if (mask.width, mask.height) == (width, height) or mask.bitmap.size == 0:
        return mask.x, mask.y, mask.bitmap
    # Column c of the label image is centred at (c + 0.5) * mask.width / width of the mask image.
    cols = ((np.arange(width) + 0.5) * mask.width / width).astype(np.int64) - mask.x
    rows = ((np.arange(height) + 0.5) * mask.height / height).astype(np.int64) - mask.y
    h, w = mask.bitmap.shape
    col = np.flatnonzero((cols >= 0) & (cols < w))
    row = np.flatnonzero((rows >= 0) & (rows < h))
    if len(col) == 0 or len(row) == 0:
        return 0, 0, np.zeros((0, 0), dtype=np.bool_)
    return int(col[0]), int(row[0]), mask.bitmap[np.ix_(rows[row], cols[col])]


# Distances are stored in units of 1 / STEPS pixel.
STEPS = 16


def reach_of(band: float) -> int:
    """Return how far from a border pixel `stamp_borders` writes distances; both in pixels."""
    return int(np.ceil(band + 0.5)) if band > 0 else 0


@kernel
def stamp_borders(labels: Any, boxes: Any, reach: Any, code: Any, distance: Any) -> None:
    """Write to the pixels around each mask's border how far away the border is.

    Parameters
    ----------
    labels : (h, w) int32, mask index, -1 = none.
    boxes : (n, 5) int32: mask index and its first row, end row, first column, end column.
    reach : see `reach_of`.
    code : (h, w) int32, initially `labels`. A pixel on no mask but near mask m (the nearest)
        becomes -2 - m.
    distance : (h, w) uint8, initially the band in 1/16 px. It becomes the distance to the border
        of the pixel's own or nearest mask, if less. The photo's edge is not a border.
    """
    rows, cols = labels.shape
    size = 2 * reach + 1
    inner, outer = np.zeros((size, size)), np.zeros((size, size))
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            length = np.sqrt(float(dy * dy + dx * dx))
            # The border runs between two pixel centres, half a pixel from each.
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


class ViewEvidence(NamedTuple):
    """The observations of one view: ascending candidate numbers, and columns as of `Evidence`."""

    face: Ints
    label: Ints
    share: NDArray[np.float32]
    ease: NDArray[np.float32]
    border: NDArray[np.float32]
    detail: NDArray[np.float32]


class Columns(NamedTuple):
    """The columns of `Evidence`."""

    projection: Ints
    view: Ints
    share: NDArray[np.float32]
    ease: NDArray[np.float32]
    border: NDArray[np.float32]
    detail: NDArray[np.float32]


def by_face(
    tables: Sequence[ViewEvidence], first_mask: NDArray[np.int64], count: int
) -> tuple[Ints, NDArray[np.int64], Columns]:
    """Regroup the views' tables by face, keeping the order of views.

    Drop candidates on which no view sees a mask (the mask lies on an object in front of them).

    Parameters
    ----------
    count : number of candidates.

    Returns
    -------
    kept : (C,) int32, candidate numbers; starts : (C + 1,) int64; the columns, each (N,).
    """
    entries = np.zeros(count, dtype=np.int32)
    positive = np.zeros(count, dtype=np.bool_)

    def counted(begin: int, end: int) -> None:
        for table in tables:
            _count(begin, end, table.face, table.label, entries, positive)

    in_ranges(counted, count)
    kept = np.flatnonzero(positive).astype(np.int32)
    starts = np.zeros(len(kept) + 1, dtype=np.int64)
    np.cumsum(entries[kept], out=starts[1:])
    place = np.full(count, -1, dtype=np.int64)
    place[kept] = starts[:-1]
    size = int(starts[-1])
    ints = np.zeros((2, size), dtype=np.int32)
    floats = np.zeros((4, size), dtype=np.float32)
    columns = Columns(*ints, *floats)

    def filled(begin: int, end: int) -> None:
        for view, table in enumerate(tables):
            _fill(begin, end, *table, view, int(first_mask[view]), place, *columns)

    in_ranges(filled, count)
    return kept, starts, columns


@kernel
def _lower_bound(values: Any, minimum: Any) -> Any:
    """Return the position of the first of ascending values that is at least `minimum`."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if values[middle] < minimum:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def _count(begin: Any, end: Any, face: Any, label: Any, entries: Any, positive: Any) -> None:
    for k in range(_lower_bound(face, begin), _lower_bound(face, end)):
        entries[face[k]] += 1
        if label[k] >= 0:
            positive[face[k]] = True


@kernel
def _fill(
    begin: Any,
    end: Any,
    face: Any,
    label: Any,
    in_share: Any,
    in_ease: Any,
    in_border: Any,
    in_detail: Any,
    number: Any,
    first: Any,
    place: Any,
    projection: Any,
    view: Any,
    share: Any,
    eased: Any,
    border: Any,
    detail: Any,
) -> None:
    for k in range(_lower_bound(face, begin), _lower_bound(face, end)):
        at = place[face[k]]
        if at < 0:
            continue
        place[face[k]] = at + 1
        mask = label[k]
        projection[at] = first + mask if mask >= 0 else (mask - first if mask < -1 else -1)
        view[at], share[at], eased[at] = number, in_share[k], in_ease[k]
        border[at], detail[at] = in_border[k], in_detail[k]
