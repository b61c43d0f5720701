"""Packing rectangles into a square, by shelves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["fit_scale", "shelves"]

Whole = NDArray[np.int64]
HALVINGS = 40


def shelves(sizes: Whole, width: int) -> tuple[Whole, int]:
    """Place rectangles on shelves of the given width, tallest first.

    Parameters
    ----------
    sizes : (n, 2) width and height, none wider than `width`.

    Returns
    -------
    (n, 2) left and top of each, and the height used.
    """
    places = np.zeros_like(sizes)
    left = top = shelf = 0
    for index in np.lexsort((sizes[:, 0], -sizes[:, 1])):
        wide, high = int(sizes[index, 0]), int(sizes[index, 1])
        if left + wide > width:
            top, left, shelf = top + shelf, 0, 0
        places[index] = left, top
        left += wide
        shelf = max(shelf, high)
    return places, top + shelf


def fit_scale(
    extents: NDArray[np.float64], side: int, pad: int, most: float
) -> tuple[float, Whole, Whole]:
    """The largest scale at which all rectangles fit into a square.

    Parameters
    ----------
    extents : (n, 2) world units.
    side : of the square, pixels.
    pad : pixels around each rectangle.
    most : a scale (pixels per world unit) that is never passed.

    Returns
    -------
    Scale, (n, 2) sizes in pixels with padding, (n, 2) places.
    """

    def at(scale: float) -> tuple[Whole, Whole, bool]:
        sizes = np.ceil(extents * scale).astype(np.int64) + 1 + 2 * pad
        if int(sizes[:, 0].max()) > side:
            return sizes, sizes, False
        places, used = shelves(sizes, side)
        return sizes, places, used <= side

    low = most
    for _ in range(HALVINGS):
        if at(low)[2]:
            break
        low /= 2
    else:
        raise ValueError(f"{len(extents)} charts do not fit into {side} pixels at any scale")
    high = min(2 * low, most)
    while high - low > 0.01 * low:
        middle = (low + high) / 2
        low, high = (middle, high) if at(middle)[2] else (low, middle)
    sizes, places, _ = at(low)
    return low, sizes, places
