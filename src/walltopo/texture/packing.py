"""Rectangles into one square: on shelves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError

__all__ = ["pack"]

_SHRINK = 0.97


def _place(sizes: NDArray[np.int64], side: int) -> NDArray[np.int64] | None:
    """(n, 2) left top corners on shelves, tallest first; None if they do not fit."""
    order = np.argsort(-sizes[:, 1], kind="stable")
    place = np.zeros_like(sizes)
    x = y = shelf = 0
    for k in order.tolist():
        width, height = int(sizes[k, 0]), int(sizes[k, 1])
        if x + width > side:
            x, y, shelf = 0, y + shelf, 0
        if width > side or y + height > side:
            return None
        place[k] = x, y
        x += width
        shelf = max(shelf, height)
    return place


def pack(
    sizes: NDArray[np.float64], border: int, side: int, fixed: int = 0
) -> tuple[NDArray[np.int64], float]:
    """Where rectangles lie in a square atlas, all made smaller alike if they must be.

    Parameters
    ----------
    sizes : (n, 2) float width and height, pixels.
    border : pixels added on each side of each rectangle, not scaled.
    side : side of the atlas, pixels.
    fixed : side of one more square, placed last in the result, that is never made smaller.

    Returns
    -------
    (n, 2) or (n + 1, 2) int64 left top corners inside the border, and the scale <= 1 that
    applies to sizes.

    Raises
    ------
    StageError : the borders alone fill the atlas.
    """
    extra = np.full((1 if fixed else 0, 2), fixed, dtype=np.int64)
    scale = 1.0
    while scale > 0.05:
        whole = np.concatenate([np.ceil(sizes * scale).astype(np.int64) + 1, extra]) + 2 * border
        area = int(whole.prod(axis=1).sum())
        place = _place(whole, side) if area <= side * side else None
        if place is not None:
            return place + border, scale
        scale *= _SHRINK
    raise StageError(
        f"{len(sizes)} charts do not fit a texture of {side} pixels",
        "Set a larger texture.size, or a larger dense.edge_length.",
    )
