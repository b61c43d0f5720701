"""Pack rectangles into a square picture, in rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError

Whole = NDArray[np.int64]

# Maximum halvings of the scale, and relative precision of the search for the largest scale.
_HALVINGS = 40
_PRECISION = 0.01


def pack_rows(sizes: Whole, width: int) -> tuple[Whole, int]:
    """Place rectangles in rows of a given width, tallest first.

    Parameters
    ----------
    sizes : (n, 2) width and height, none wider than `width`.

    Returns
    -------
    (n, 2) left and top of each rectangle, and the used height.
    """
    places = np.zeros_like(sizes)
    left = top = row_height = 0
    for index in np.lexsort((sizes[:, 0], -sizes[:, 1])):
        wide, high = int(sizes[index, 0]), int(sizes[index, 1])
        if left + wide > width:
            top, left, row_height = top + row_height, 0, 0
        places[index] = left, top
        left += wide
        row_height = max(row_height, high)
    return places, top + row_height


def fit_scale(
    extents: NDArray[np.float64],
    side: int,
    pad: int,
    max_scale: float,
    min_scale: float = 0.0,
    fixed: int = 0,
) -> tuple[float, Whole, Whole]:
    """Return the largest scale, to one per cent, at which all rectangles fit into a square.

    Parameters
    ----------
    extents : (n, 2) width and height, any unit.
    side : side of the square, pixels.
    pad : pixels around each rectangle, not scaled.
    max_scale, min_scale : range of the scale, pixels per unit.
    fixed : side of one more square, pixels, not scaled and placed last; 0 = none.

    Returns
    -------
    Scale, (n, 2) padded sizes in pixels, (n, 2) left top corners; n + 1 rectangles with `fixed`.

    Raises
    ------
    StageError : the rectangles do not fit at `min_scale`.
    """
    extra = np.full((1 if fixed else 0, 2), fixed, dtype=np.int64)

    def pack_at(scale: float) -> tuple[Whole, Whole, bool]:
        scaled = np.ceil(extents * scale).astype(np.int64) + 1
        sizes = np.concatenate([scaled, extra]) + 2 * pad
        if int(sizes[:, 0].max()) > side or int(sizes.prod(axis=1).sum()) > side * side:
            return sizes, sizes, False
        places, used = pack_rows(sizes, side)
        return sizes, places, used <= side

    low = max_scale
    for _ in range(_HALVINGS):
        if low <= min_scale or pack_at(low)[2]:
            break
        low = max(low / 2, min_scale)
    high = min(2 * low, max_scale)
    while high - low > _PRECISION * low:
        middle = (low + high) / 2
        low, high = (middle, high) if pack_at(middle)[2] else (low, middle)
    sizes, places, fits = pack_at(low)
    if not fits:
        raise StageError(
            f"{len(extents)} charts do not fit a picture of {side} pixels",
            "Set a larger picture (texture.size) or longer mesh edges (dense.edge_length).",
        )
    return low, sizes, places
