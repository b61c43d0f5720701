"""How far a pixel is from the border of its mask: evidence that is softer than in or out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["STEPS", "soften"]

# Distances are stored in these parts of a pixel.
STEPS = 16


def soften(labels: NDArray[np.int32], band: float) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
    """Distances to mask borders, near the borders.

    Parameters
    ----------
    labels : (h, w) int32, mask index, -1 = none.
    band : pixels; distances beyond it are not told apart.

    Returns
    -------
    code : (h, w) int32: the mask index on a mask; -2 - index on none but within `band` of that
        mask, the nearest; -1 elsewhere.
    distance : (h, w) uint8, distance to the border in 1/16 px, at most `band`.
    """
    code = labels.copy()
    distance = np.full(labels.shape, round(band * STEPS), dtype=np.uint8)
    if band > 0:
        _stamp(labels, int(np.ceil(band + 0.5)), code, distance)
    return code, distance


@njit(nogil=True, cache=True)
def _stamp(labels: Any, reach: Any, code: Any, distance: Any) -> None:
    """Let every border pixel tell its surroundings how far away they are."""
    rows, cols = labels.shape
    size = 2 * reach + 1
    inner, outer = np.zeros((size, size)), np.zeros((size, size))
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            length = np.sqrt(float(dy * dy + dx * dx))
            # The border runs between two pixels' centres, half a pixel from each.
            inner[dy + reach, dx + reach] = (length + 0.5) * STEPS
            outer[dy + reach, dx + reach] = max(length - 0.5, 0.0) * STEPS
    for row in range(rows):
        for col in range(cols):
            label = labels[row, col]
            if label < 0:
                continue
            inside = True
            if row > 0:
                inside &= labels[row - 1, col] == label
            if row < rows - 1:
                inside &= labels[row + 1, col] == label
            if col > 0:
                inside &= labels[row, col - 1] == label
            if col < cols - 1:
                inside &= labels[row, col + 1] == label
            if inside:
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
