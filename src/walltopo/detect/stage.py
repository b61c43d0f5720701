"""The `detect` stage: photos in, `detections.json` out."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask, Progress
from walltopo.core.files import atomic_path
from walltopo.detect.contract import DetectSettings, Reads, Writes
from walltopo.detect.detector import Detector, open_detector
from walltopo.detect.draw import draw_found
from walltopo.imaging.photo_file import read_rgb
from walltopo.scans.context import Context
from walltopo.scans.detections import Detections
from walltopo.scans.manifest import Metrics

__all__ = ["PHOTO_SUFFIXES", "detect_photos", "photos_in", "run"]

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


def _walk(photos: Sequence[Path], progress: Progress) -> Iterator[tuple[Path, NDArray[np.uint8]]]:
    progress.step("detect", len(photos))
    for path in photos:
        yield path, read_rgb(path)
        progress.advance()


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
    masks: dict[str, tuple[Mask, ...]] = {}
    sizes: dict[str, tuple[int, int]] = {}
    seconds: list[float] = []
    for path, photo in _walk(photos, progress):
        begin = time.perf_counter()
        found = detector.detect(photo)
        seconds.append(time.perf_counter() - begin)
        masks[path.name] = found.masks
        sizes[path.name] = (photo.shape[1], photo.shape[0])
        progress.detail(f"{path.name}: {len(found)} objects in {seconds[-1]:.2f} s")
        if drawings is not None:
            _save_drawing(drawings / path.name, draw_found(photo, found))
    counts = [len(m) for m in masks.values()]
    empty = [name for name, m in masks.items() if not m]
    if empty:
        progress.note(f"nothing found in {len(empty)} photos: {', '.join(empty[:5])}")
    metrics: Metrics = {
        "model": detector.description,
        "photos": len(photos),
        "masks": sum(counts),
        "masks_per_photo": round(float(np.mean(counts)), 1),
        "photos_without_masks": len(empty),
        "seconds_per_photo": round(float(np.median(seconds)), 3),
    }
    told = f"walltopo: {detector.description}"
    return Detections(masks, sizes, dict(detector.classes), told), metrics


def run(reads: Reads, settings: DetectSettings, context: Context) -> Writes:
    """Detect holds and volumes in the scan's photos."""
    photos = sorted(reads.photos.path(photo.name) for photo in reads.photo_list.photos)
    return Writes(*detect_photos(photos, open_detector(settings), context.progress))
