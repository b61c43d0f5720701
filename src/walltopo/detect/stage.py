"""The `detect` stage: photos in, `detections.json` out."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask, Progress
from walltopo.detect.contract import DetectSettings
from walltopo.detect.detector import Detector, open_detector
from walltopo.detect.draw import draw_found
from walltopo.imaging.photo_file import read_rgb
from walltopo.scans.detections import write_coco_masks
from walltopo.scans.folder import ScanFolder, atomic_path

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
    output: Path,
    progress: Progress,
    drawings: Path | None = None,
) -> dict[str, Any]:
    """Detect in every photo and write one COCO file; masks are in each photo's own pixels.

    Parameters
    ----------
    photos : files; their names (without folder) become the file names in COCO.
    drawings : folder for pictures of the result, or None.

    Returns
    -------
    Counts and times, for the stage's summary.
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
    write_coco_masks(
        output, masks, sizes, detector.classes, {"description": f"walltopo: {detector.description}"}
    )
    counts = [len(m) for m in masks.values()]
    empty = [name for name, m in masks.items() if not m]
    if empty:
        progress.note(f"nothing found in {len(empty)} photos: {', '.join(empty[:5])}")
    return {
        "model": detector.description,
        "photos": len(photos),
        "masks": sum(counts),
        "masks_per_photo": round(float(np.mean(counts)), 1),
        "photos_without_masks": len(empty),
        "seconds_per_photo": round(float(np.median(seconds)), 3),
    }


def run(scan: ScanFolder, settings: DetectSettings, progress: Progress) -> dict[str, Any]:
    """Detect holds and volumes in the scan's photos; writes `detections.json`."""
    detector = open_detector(settings)
    return detect_photos(photos_in(scan.photos), detector, scan.detections, progress)
