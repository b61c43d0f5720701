"""The photos of bad inputs, and the arguments that scan them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image


def picture(seed: int, size: tuple[int, int] = (640, 480)) -> Image.Image:
    """Return a sharp picture of random blocks, different for every seed."""
    generator = np.random.default_rng(seed)
    blocks = generator.integers(0, 255, (size[1] // 8, size[0] // 8, 3), dtype=np.uint8)
    return Image.fromarray(blocks).resize(size, Image.Resampling.NEAREST)


def photos_in(folder: Path, count: int = 3) -> Path:
    """Write photos that ingest takes, p0.jpg and so on, into a folder; return it."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        picture(number).save(folder / f"p{number}.jpg")
    return folder


def scan_of(photos: Path, *more: str, to: str = "ingest") -> list[str]:
    """Return the arguments that scan a folder of photos into `scan` beside it."""
    return [str(photos), "-o", str(photos.parent / "scan"), "--to", to, *more]
