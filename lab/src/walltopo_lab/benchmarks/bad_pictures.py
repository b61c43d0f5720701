"""The picture that the photos of bad inputs show."""

from __future__ import annotations

import numpy as np
from PIL import Image


def picture(seed: int, size: tuple[int, int] = (640, 480)) -> Image.Image:
    """Return a sharp picture of random blocks, different for every seed."""
    generator = np.random.default_rng(seed)
    blocks = generator.integers(0, 255, (size[1] // 8, size[0] // 8, 3), dtype=np.uint8)
    return Image.fromarray(blocks).resize(size, Image.Resampling.NEAREST)
