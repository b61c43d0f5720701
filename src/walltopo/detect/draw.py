"""Pictures of what was found."""

from __future__ import annotations

import colorsys
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.detect.found import Found

__all__ = ["draw_found"]


def draw_found(photo: NDArray[np.uint8], found: Found) -> NDArray[np.uint8]:
    """The photo with each mask tinted and outlined, (H, W, 3) uint8 RGB.

    Holds are outlined in white, volumes in black; the tint only tells neighbours apart.
    """
    tinted = photo.astype(np.float32)
    outlines: list[tuple[list[Any], tuple[int, int, int]]] = []
    for k, mask in enumerate(found.masks):
        h, w = mask.bitmap.shape
        colour = np.array(colorsys.hsv_to_rgb((k * 0.618) % 1.0, 0.9, 1.0), np.float32) * 255
        window = tinted[mask.y : mask.y + h, mask.x : mask.x + w]
        window[mask.bitmap] = 0.55 * window[mask.bitmap] + 0.45 * colour
        shapes, _ = cv2.findContours(
            mask.bitmap.astype(np.uint8),
            cv2.RETR_EXTERNAL,
            cv2.CHAIN_APPROX_NONE,
            offset=(mask.x, mask.y),
        )
        line = (255, 255, 255) if mask.label == 1 else (0, 0, 0)
        outlines.append((list(shapes), line))
    picture = np.ascontiguousarray(tinted.clip(0, 255).astype(np.uint8))
    thick = max(1, round(max(photo.shape[:2]) / 1200))
    for contours, line in outlines:
        cv2.drawContours(picture, contours, -1, line, thick)
    return np.asarray(picture, dtype=np.uint8)
