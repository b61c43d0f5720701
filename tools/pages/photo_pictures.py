"""The setter's pictures of good and bad photos, made from the demo photos.

    python -m tools.pages.photo_pictures examples/demo-photos docs/pictures/setter

Each fault is applied to a good photo: motion blur, too little light, too close.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

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
    steps = [_read(photos / name, WIDTH * 2 // 3) for name in STEPS]
    gap = np.full((steps[0].shape[0], 8, 3), 255, np.uint8)
    good = _read(photos / GOOD)
    pictures = {
        "plate": _read(photos / PLATE),
        "steps": np.hstack([steps[0], gap, steps[1], gap, steps[2]]),
        "good": good,
        "blurred": _moved(good),
        "dark": _dim(good),
        "near": _near(_whole(photos / GOOD)),
    }
    for name, picture in pictures.items():
        cv2.imwrite(str(out / f"{name}.jpg"), picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


def _read(path: Path, width: int = WIDTH) -> Photo:
    return _sized(_whole(path), width)


def _whole(path: Path) -> Photo:
    return np.asarray(cv2.cvtColor(read_rgb(path), cv2.COLOR_RGB2BGR), np.uint8)


def _sized(photo: Photo, width: int) -> Photo:
    height = round(photo.shape[0] * width / photo.shape[1])
    return np.asarray(cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _moved(photo: Photo) -> Photo:
    """Return the photo with motion blur along a line, as from a moving hand."""
    length = WIDTH // 32
    path = np.eye(length, dtype=np.float32) / length
    return np.asarray(cv2.filter2D(photo, -1, path), np.uint8)


def _dim(photo: Photo) -> Photo:
    """Return the photo at a twentieth of the light, with sensor noise."""
    rng = np.random.default_rng(0)
    light = linear_from_srgb8(photo) / 20.0
    light += rng.normal(0.0, 0.004, light.shape)
    return srgb8_from_linear(np.clip(light, 0.0, 1.0))


def _near(photo: Photo) -> Photo:
    """Return a close-up of two holds, which shows no position on the wall."""
    height, width = photo.shape[:2]
    part = photo[height // 2 : height * 3 // 4, width // 4 : width // 2]
    return _sized(part, WIDTH)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("photos", type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args(arguments)
    draw(args.photos, args.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
