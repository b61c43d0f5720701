"""Draw a standing person that the network finds."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# From, to, both radii: shares of the body's height; and the colour.
_SHIRT, _TROUSERS, _SKIN = (200, 60, 60), (40, 50, 80), (205, 160, 130)
_LIMBS = [
    ((0.22, 0.52), (0.19, 0.74), 0.05, 0.036, _TROUSERS),
    ((0.28, 0.52), (0.32, 0.74), 0.05, 0.036, _TROUSERS),
    ((0.19, 0.74), (0.19, 0.93), 0.036, 0.025, _TROUSERS),
    ((0.32, 0.74), (0.31, 0.93), 0.036, 0.025, _TROUSERS),
    ((0.19, 0.95), (0.15, 0.97), 0.022, 0.018, (30, 30, 30)),
    ((0.31, 0.95), (0.35, 0.97), 0.022, 0.018, (30, 30, 30)),
    ((0.25, 0.12), (0.25, 0.20), 0.025, 0.03, _SKIN),
    ((0.25, 0.25), (0.25, 0.50), 0.085, 0.07, _SHIRT),
    ((0.18, 0.22), (0.32, 0.22), 0.038, 0.038, _SHIRT),
    ((0.17, 0.22), (0.12, 0.36), 0.033, 0.026, _SHIRT),
    ((0.33, 0.22), (0.38, 0.36), 0.033, 0.026, _SHIRT),
    ((0.12, 0.36), (0.10, 0.52), 0.022, 0.015, _SKIN),
    ((0.38, 0.36), (0.40, 0.52), 0.022, 0.015, _SKIN),
    ((0.25, 0.075), (0.25, 0.095), 0.05, 0.045, _SKIN),
    ((0.25, 0.055), (0.25, 0.062), 0.053, 0.05, (50, 35, 25)),
]


def drawn_person(height: int) -> tuple[Floats, Floats]:
    """A person of this height: (h, h / 2, 3) colours and (h, h / 2, 1) cover."""
    large = 4 * height
    colours, cover = np.zeros((large, large // 2, 3), np.float32), np.zeros((large, large // 2))
    for begin, end, first, last, colour in _LIMBS:
        for t in np.linspace(0, 1, 60):
            x, y = ((np.array(begin) * (1 - t) + np.array(end) * t) * large).tolist()
            radius = (first + (last - first) * t) * large
            cv2.circle(cover, (int(x), int(y)), int(radius), 1.0, -1)
            for k in np.linspace(1, 0.05, 14):  # lit from the upper left
                at = (int(x - radius * 0.25 * (1 - k)), int(y - radius * 0.2 * (1 - k)))
                shade = 0.62 + 0.4 * (1 - k)
                cv2.circle(colours, at, max(1, int(radius * k)), [c * shade for c in colour], -1)
    size = (height // 2, height)
    small, part = (
        np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.float64)
        for image in (colours, cover)
    )
    return small, part[..., None]


def wall(seed: int, width: int = 1280, height: int = 960) -> Floats:
    """A rough plain wall, (height, width, 3)."""
    grain = np.random.default_rng(seed).normal(150, 18, (height, width, 3)).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(grain, (0, 0), 1.2), dtype=np.float64)


def with_person(
    wall: Floats, x: int, y: int, height: int
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """The picture with a person whose upper left corner is at x, y; and the person's pixels."""
    colours, cover = drawn_person(height)
    picture, truth = wall.copy(), np.zeros(wall.shape[:2], dtype=np.bool_)
    window = np.s_[y : y + height, x : x + height // 2]
    picture[window] = picture[window] * (1 - cover) + colours * cover
    truth[window] = cover[..., 0] > 0.5
    return picture.clip(0, 255).astype(np.uint8), truth
