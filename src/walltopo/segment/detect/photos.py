"""Detect holds and volumes in photos, and draw the result."""

from __future__ import annotations

import colorsys
import time
from collections.abc import Callable, Sequence
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
from walltopo.segment.detect.photo_detections import PhotoDetections

_MAX_ON_PEOPLE = 0.5  # share of a detection's pixels
PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp")


def photos_in(folder: Path) -> list[Path]:
    """Return the photos of a folder, sorted by name."""
    if not folder.is_dir():
        raise InputError(f"{folder}: the folder of photos does not exist")
    photos = sorted(p for p in folder.iterdir() if p.suffix.lower() in PHOTO_SUFFIXES)
    if not photos:
        raise InputError(f"{folder}: contains no photos ({', '.join(PHOTO_SUFFIXES)})")
    return photos


def _save_drawing(path: Path, picture: NDArray[np.uint8]) -> None:
    with atomic_path(path) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))


@dataclass(frozen=True)
class _PhotoResult:
    """The detections of one photo, and the run time."""

    found: PhotoDetections
    size: tuple[int, int]
    seconds: float
    model: str
    classes: dict[int, str]


def _detect_photo(
    drawings: Path | None, detector: Detector, path: Path, people: NDArray[np.bool_] | None
) -> _PhotoResult:
    photo = read_rgb(path)
    begin = time.perf_counter()
    found = detector.detect(photo)
    seconds = time.perf_counter() - begin
    if people is not None:
        found = without_people(found, people)
    if drawings is not None:
        _save_drawing(drawings / path.name, draw_found(photo, found))
    size = (photo.shape[1], photo.shape[0])
    return _PhotoResult(found, size, seconds, detector.description, dict(detector.classes))


def without_people(found: PhotoDetections, people: NDArray[np.bool_]) -> PhotoDetections:
    """Return the detections that do not lie mostly on people, such as shoes.

    Parameters
    ----------
    people : (H, W) bool, the pixels of people in the photo.
    """
    height, width = people.shape
    kept = []
    for k, box in enumerate(found.boxes):
        x0, y0 = (max(0, int(value)) for value in box[:2])
        x1, y1 = min(width, int(box[2]) + 1), min(height, int(box[3]) + 1)
        on = people[y0:y1, x0:x1]
        if found.masks:
            mask = found.masks[k]
            h, w = mask.bitmap.shape
            on = people[mask.y : mask.y + h, mask.x : mask.x + w][mask.bitmap]
        if not on.size or on.mean() < _MAX_ON_PEOPLE:
            kept.append(k)
    return found.pick(kept)


def detect_photos(
    photos: Sequence[Path],
    detector: Detector,
    progress: Progress,
    drawings: Path | None = None,
    hidden: Callable[[str], NDArray[np.bool_] | None] | None = None,
) -> tuple[Detections, Metrics]:
    """Detect objects in every photo; the masks are in each photo's own pixels.

    Parameters
    ----------
    photos : files; their names (without folder) become the file names in COCO.
    drawings : folder for pictures of the masks, or None.
    hidden : returns the pixels of people by the photo's name, None without any; objects that lie
        mostly on them are left out.

    Returns
    -------
    The detections, and counts and times for the stage's summary.
    """
    progress.step("detect", len(photos))
    results: list[_PhotoResult] = []
    for path in photos:
        result = _detect_photo(drawings, detector, path, hidden(path.name) if hidden else None)
        results.append(result)
        progress.advance()
        progress.detail(f"{path.name}: {len(result.found)} objects in {result.seconds:.2f} s")
    masks = {path.name: result.found.masks for path, result in zip(photos, results, strict=True)}
    sizes = {path.name: result.size for path, result in zip(photos, results, strict=True)}
    empty = [name for name, found in masks.items() if not found]
    if empty:
        progress.note(f"nothing found in {len(empty)} photos: {', '.join(empty[:5])}")
    counts = [len(found) for found in masks.values()]
    metrics: Metrics = {
        "model": results[0].model,
        "photos": len(photos),
        "masks": sum(counts),
        "masks_per_photo": round(float(np.mean(counts)), 1),
        "photos_without_masks": len(empty),
        "seconds_per_photo": round(float(np.median([r.seconds for r in results])), 3),
    }
    source = f"walltopo: {results[0].model}"
    return Detections(masks, sizes, results[0].classes, source), metrics


def draw_found(photo: NDArray[np.uint8], found: PhotoDetections) -> NDArray[np.uint8]:
    """Return the photo with each mask tinted and outlined, (H, W, 3) uint8 RGB.

    Holds are outlined in white, volumes in black; the tint only separates neighbours.
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
