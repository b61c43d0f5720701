"""The holds of single photos, as `classify` sees those of a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.describe.classify.colour import with_white
from walltopo.describe.classify.light import ERODE
from walltopo.describe.classify.observations import HoldView, hold_views
from walltopo.describe.settings import ClassifySettings
from walltopo.images.colour import linear_from_srgb8
from walltopo.scans.pictures import SceneLight
from walltopo.segment.detect.detector import Detector

MIN_SCORE = 0.5  # of a detection that is certainly a hold
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_RIM = 7  # pixels around holds that are no wall


@dataclass(frozen=True, eq=False)
class PhotoViews:
    """The holds that a detector finds in one photo.

    Parameters
    ----------
    views : the one view of each hold, by its number from 1.
    light : one light for the photo, whose white is its brightest paint or its wall.
    numbers : (H, W) int32, the hold at each pixel, 0 = none.
    """

    views: dict[int, list[HoldView]]
    light: SceneLight
    numbers: NDArray[np.int32]


def photo_views(photo: NDArray[np.uint8], detector: Detector) -> PhotoViews:
    """Return the holds of an (H, W, 3) photo; volumes are left out."""
    found = detector.detect(photo)
    hold = next(number for number, name in detector.classes.items() if name == "hold")
    numbers = np.zeros(photo.shape[:2], dtype=np.int32)
    # The surest detections are drawn last, over the others.
    for row in np.argsort(found.scores, kind="stable").tolist():
        if found.scores[row] >= MIN_SCORE and found.labels[row] == hold:
            numbers[found.masks[row].full()] = row + 1
    settings = ClassifySettings()
    flat = np.ones(numbers.shape, dtype=np.float32)  # nothing occludes anything
    seen = hold_views(0, photo, numbers, flat, ERODE, settings.cutout_px)
    views = {view.hold: [view] for view in seen}
    none = np.zeros((0, 3))
    light = SceneLight(np.zeros((1, 3)), none, none, _wall_luminance(photo, numbers))
    return PhotoViews(views, with_white(light, views), numbers)


def _wall_luminance(photo: NDArray[np.uint8], numbers: NDArray[np.int32]) -> float:
    """Return the median luminance of the pixels between the holds, without black borders."""
    covered = cv2.dilate((numbers > 0).astype(np.uint8), np.ones((_RIM, _RIM), np.uint8))
    wall = linear_from_srgb8(photo[(covered == 0) & (photo.max(axis=2) > 8)]) @ _LUMINANCE
    return float(np.median(wall)) if len(wall) else 0.0


def hold_at(numbers: NDArray[np.int32], place: Sequence[int]) -> int:
    """Return the number of the hold at x, y; 0 = none."""
    x, y = place
    return int(numbers[y, x])
