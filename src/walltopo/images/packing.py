"""Packing rectangles into a square picture, on shelves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError

Whole = NDArray[np.int64]

# Halvings of the scale before rectangles count as too many, and how near to the largest scale the
# search stops.
_HALVINGS = 40
_EXACT = 0.01


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
    extents: NDArray[np.float64],
    side: int,
    pad: int,
    most: float,
    least: float = 0.0,
    fixed: int = 0,
) -> tuple[float, Whole, Whole]:
    """The largest scale, to one per cent, at which all rectangles fit into a square.

    Parameters
    ----------
    extents : (n, 2) width and height, any unit.
    side : of the square, pixels.
    pad : pixels around each rectangle, not scaled.
    most, least : scales, pixels per unit, that are never passed.
    fixed : side of one more square, pixels, that is not scaled; placed last, 0 = none.

    Returns
    -------
    Scale, (n, 2) sizes in pixels with padding, (n, 2) places of their left top corners; of n + 1
    rectangles with `fixed`.

    Raises
    ------
    StageError : they do not fit at the least scale.
    """
    extra = np.full((1 if fixed else 0, 2), fixed, dtype=np.int64)

    def at(scale: float) -> tuple[Whole, Whole, bool]:
        scaled = np.ceil(extents * scale).astype(np.int64) + 1
        sizes = np.concatenate([scaled, extra]) + 2 * pad
        if int(sizes[:, 0].max()) > side or int(sizes.prod(axis=1).sum()) > side * side:
            return sizes, sizes, False
        places, used = shelves(sizes, side)
        return sizes, places, used <= side

    low = most
    for _ in range(_HALVINGS):
        if low <= least or at(low)[2]:
            break
        low = max(low / 2, least)
    high = min(2 * low, most)
    while high - low > _EXACT * low:
        middle = (low + high) / 2
        low, high = (middle, high) if at(middle)[2] else (low, middle)
    sizes, places, fits = at(low)
    if not fits:
        raise StageError(
            f"{len(extents)} charts do not fit a picture of {side} pixels",
            "A larger picture has room (texture.size), or a mesh of longer edges "
            "(dense.edge_length).",
        )
    return low, sizes, places
