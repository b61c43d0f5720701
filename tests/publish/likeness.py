"""How alike two screenshots are, loosely: fonts and drivers may differ, a fault may not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

WIDTH = 320  # pixels that references are kept at
BLUR = 4.0  # pixels of 320: more than letters of another font differ by
TILE = 16
# Greys of 255 that may differ: on average, and in the worst tile.
MEAN_BOUND, TILE_BOUND = 3.0, 25.0


def small(path: Path) -> Image.Image:
    """A picture `WIDTH` pixels wide."""
    with Image.open(path) as opened:
        picture = opened.convert("RGB")
    return picture.resize(
        (WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.BOX
    )


def _soft(picture: Image.Image) -> NDArray[np.float64]:
    return np.asarray(picture.filter(ImageFilter.GaussianBlur(BLUR)), dtype=np.float64)


def difference(one: Image.Image, other: Image.Image) -> tuple[float, float]:
    """Mean difference of two blurred pictures, and that of the worst tile; greys of 255."""
    if one.size != other.size:
        return 255.0, 255.0
    off = np.abs(_soft(one) - _soft(other)).mean(axis=2)
    height, width = (side // TILE * TILE for side in off.shape)
    tiles: Any = off[:height, :width].reshape(height // TILE, TILE, width // TILE, TILE)
    return float(off.mean()), float(tiles.mean(axis=(1, 3)).max())


def alike(one: Image.Image, other: Image.Image) -> bool:
    """Return whether both differences are within their bounds."""
    mean, tile = difference(one, other)
    return mean <= MEAN_BOUND and tile <= TILE_BOUND
