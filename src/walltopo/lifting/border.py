"""How far a pixel is from the border of its mask: evidence that is softer than in or out."""

from __future__ import annotations

from typing import Any

import numpy as np

from walltopo.kernels import kernel

__all__ = ["STEPS", "reach_of", "stamp_borders"]

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
