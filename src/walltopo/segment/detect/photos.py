"""Detect holds and volumes in photos, and draw the result."""

from __future__ import annotations

import colorsys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress
from walltopo.core.files import atomic_path
from walltopo.images.files import read_rgb
from walltopo.scans.detections import Detections
from walltopo.scans.manifest import Metrics
from walltopo.segment.detect.detector import Detector
from walltopo.segment.detect.found import Found

PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp")


def photos_in(folder: Path) -> list[Path]:
    """The photos of a folder, sorted by name."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder of photos")
    photos = sorted(p for p in folder.iterdir() if p.suffix.lower() in PHOTO_SUFFIXES)
    if not photos:
        raise InputError(f"{folder}: holds no photos ({', '.join(PHOTO_SUFFIXES)})")
    return photos


def _save_drawing(path: Path, picture: NDArray[np.uint8]) -> None:
    with atomic_path(path) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))


@dataclass(frozen=True)
class _Look:
    """What was seen in one photo, and how long it took."""

    found: Found
    size: tuple[int, int]
    seconds: float
    model: str
    classes: dict[int, str]


def _look(drawings: Path | None, detector: Detector, path: Path) -> _Look:
    photo = read_rgb(path)
    begin = time.perf_counter()
    found = detector.detect(photo)
    seconds = time.perf_counter() - begin
    if drawings is not None:
        _save_drawing(drawings / path.name, draw_found(photo, found))
    size = (photo.shape[1], photo.shape[0])
    return _Look(found, size, seconds, detector.description, dict(detector.classes))


def detect_photos(
    photos: Sequence[Path],
    detector: Detector,
    progress: Progress,
    drawings: Path | None = None,
) -> tuple[Detections, Metrics]:
    """Detect in every photo; masks are in each photo's own pixels.

    Parameters
    ----------
    photos : files; their names (without folder) become the file names in COCO.
    drawings : folder for pictures of the result, or None.

    Returns
    -------
    What was found, and counts and times for the stage's summary.
    """
    progress.step("detect", len(photos))
    looks: list[_Look] = []
    for path in photos:
        look = _look(drawings, detector, path)
        looks.append(look)
        progress.advance()
        progress.detail(f"{path.name}: {len(look.found)} objects in {look.seconds:.2f} s")
    masks = {path.name: look.found.masks for path, look in zip(photos, looks, strict=True)}
    sizes = {path.name: look.size for path, look in zip(photos, looks, strict=True)}
    empty = [name for name, found in masks.items() if not found]
    if empty:
        progress.note(f"nothing found in {len(empty)} photos: {', '.join(empty[:5])}")
    counts = [len(found) for found in masks.values()]
    metrics: Metrics = {
        "model": looks[0].model,
        "photos": len(photos),
        "masks": sum(counts),
        "masks_per_photo": round(float(np.mean(counts)), 1),
        "photos_without_masks": len(empty),
        "seconds_per_photo": round(float(np.median([look.seconds for look in looks])), 3),
    }
    return Detections(masks, sizes, looks[0].classes, f"walltopo: {looks[0].model}"), metrics


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
