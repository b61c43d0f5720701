"""The setter's pictures of good and bad photos, made from the demo photos.

    python -m tools.pages.photo_pictures examples/demo-photos docs/pictures/setter

Each fault is applied to a good photo: motion blur, too little light, too close.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from walltopo.images.colour import linear_from_srgb8, srgb8_from_linear
from walltopo.images.files import read_rgb

Photo = NDArray[np.uint8]

WIDTH = 480
QUALITY = 80
# Names of demo photos: one with the scale plate, three steps along the wall.
PLATE = "IMG_0017.jpg"
STEPS = ("IMG_0003.jpg", "IMG_0005.jpg", "IMG_0006.jpg")
GOOD = "IMG_0012.jpg"


def draw(photos: Path, out: Path) -> None:
    """Write `plate.jpg`, `steps.jpg`, `good.jpg`, `blurred.jpg`, `dark.jpg` and `near.jpg`."""
    out.mkdir(parents=True, exist_ok=True)
    first, *others = (_sized(read_rgb(photos / name), WIDTH * 2 // 3) for name in STEPS)
    gap = np.full((first.shape[0], 8, 3), 255, np.uint8)
    whole = read_rgb(photos / GOOD)
    good = _sized(whole)
    height, width = whole.shape[:2]
    pictures = {
        "plate": _sized(read_rgb(photos / PLATE)),
        "steps": np.hstack([first, *(part for step in others for part in (gap, step))]),
        "good": good,
        "blurred": _blurred(good),
        "dark": _dark(good),
        # Two holds, which show no position on the wall.
        "near": _sized(whole[height // 2 : height * 3 // 4, width // 4 : width // 2]),
    }
    for name, picture in pictures.items():
        Image.fromarray(picture).save(out / f"{name}.jpg", quality=QUALITY)


def _sized(photo: Photo, width: int = WIDTH) -> Photo:
    height = round(photo.shape[0] * width / photo.shape[1])
    return np.asarray(cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _blurred(photo: Photo) -> Photo:
    """Return the photo with motion blur along a line, as from a moving hand."""
    length = WIDTH // 32
    path = np.eye(length, dtype=np.float32) / length
    return np.asarray(cv2.filter2D(photo, -1, path), np.uint8)


def _dark(photo: Photo) -> Photo:
    """Return the photo at a twentieth of the light, with sensor noise."""
    rng = np.random.default_rng(0)
    light = linear_from_srgb8(photo) / 20.0
    light += rng.normal(0.0, 0.004, light.shape)
    return srgb8_from_linear(np.clip(light, 0.0, 1.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("photos", type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args()
    draw(args.photos, args.out)


if __name__ == "__main__":
    main()
