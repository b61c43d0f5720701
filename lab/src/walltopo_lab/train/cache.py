"""The training cache: photos and instance maps as plain arrays that can be memory-mapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask, Progress, Silent
from walltopo.images.files import read_rgb
from walltopo.scans.detections import read_coco_masks
from walltopo_lab.train.pseudomask import HULL_POINTS, hull_of, paint_instances

_LONGEST = 1600  # px; larger photos are shrunk before they are cached


@dataclass(frozen=True, eq=False)
class Sample:
    """One labelled photo.

    Parameters
    ----------
    name : file name of the photo.
    image : (H, W, 3) uint8, BGR.
    ids : (H, W) int16; 0 background, k + 1 the k-th object, -1 undecided.
    labels : (n,) int, 1 hold, 2 volume.
    boxes : (n, 4) float32, x0, y0, x1, y1 in pixels.
    hulls : (n, HULL_POINTS, 2) float32, points whose extent is the box.
    """

    name: str
    image: NDArray[np.uint8]
    ids: NDArray[np.int16]
    labels: NDArray[np.int64]
    boxes: NDArray[np.float32]
    hulls: NDArray[np.float32]


def read_yolo_boxes(
    path: Path, width: int, height: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Class numbers (n,) as in the file and boxes (n, 4) x0, y0, x1, y1 in pixels.

    Segments (more than four numbers) count by their extent.
    """
    classes: list[int] = []
    boxes: list[tuple[float, float, float, float]] = []
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        if not line.strip():
            continue
        try:
            values = [float(v) for v in line.split()]
        except ValueError as error:
            raise InputError(f"{path}: line {number}: not numbers: {line!r}") from error
        if len(values) == 5:
            _, x, y, w, h = values
            box = (x - w / 2, y - h / 2, x + w / 2, y + h / 2)
        elif len(values) >= 7 and len(values) % 2 == 1:
            xs, ys = values[1::2], values[2::2]
            box = (min(xs), min(ys), max(xs), max(ys))
        else:
            raise InputError(f"{path}: line {number}: neither a YOLO box nor a segment")
        classes.append(int(values[0]))
        boxes.append(box)
    scaled = np.array(boxes, dtype=np.float64).reshape(-1, 4) * [width, height, width, height]
    return np.array(classes, dtype=np.int64), scaled


def _read_photo(path: Path) -> tuple[NDArray[np.uint8], float]:
    image = cv2.cvtColor(read_rgb(path), cv2.COLOR_RGB2BGR)  # as it is cached
    scale = min(1.0, _LONGEST / max(image.shape[:2]))
    if scale < 1.0:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(image, dtype=np.uint8), scale


def _store(folder: Path, sample: Sample) -> None:
    stem = folder / sample.name
    np.save(f"{stem}.image.npy", sample.image)
    np.save(f"{stem}.ids.npy", sample.ids)
    np.savez(f"{stem}.labels.npz", labels=sample.labels, boxes=sample.boxes, hulls=sample.hulls)


def cache_yolo(dataset: Path, folder: Path, progress: Progress | None = None) -> list[str]:
    """Cache a YOLO folder (`images/`, `labels/`), its boxes made into pseudo-masks.

    Photos already in the cache are left alone. Returns the cached names.
    """
    progress = progress or Silent()
    folder.mkdir(parents=True, exist_ok=True)
    photos = sorted(p for p in (dataset / "images").iterdir() if p.suffix.lower() in _PHOTOS)
    progress.step("masks from boxes", len(photos))
    names = []
    for path in photos:
        progress.advance()
        labels_path = dataset / "labels" / f"{path.stem}.txt"
        if not labels_path.is_file():
            continue
        names.append(path.name)
        if (folder / f"{path.name}.labels.npz").is_file():
            continue
        image, _ = _read_photo(path)
        height, width = image.shape[:2]
        classes, boxes = read_yolo_boxes(labels_path, width, height)
        ids, hulls, trusted = paint_instances(image, boxes)
        boxes = np.clip(boxes, 0, [width, height, width, height])
        progress.detail(f"{path.name}: {trusted} of {len(boxes)} masks told by colour")
        _store(folder, Sample(path.name, image, ids, classes + 1, boxes.astype(np.float32), hulls))
    return names


_PHOTOS = {".jpg", ".jpeg", ".png", ".webp"}


def _paint_masks(
    masks: Sequence[Mask], width: int, height: int
) -> tuple[NDArray[np.int16], NDArray[np.float64], NDArray[np.float32]]:
    ids = np.zeros((height, width), np.int16)
    boxes = np.zeros((len(masks), 4))
    hulls = np.zeros((len(masks), HULL_POINTS, 2), np.float32)
    for k in sorted(range(len(masks)), key=lambda i: -masks[i].area):
        full = masks[k].full()
        if full.shape != ids.shape:
            full = (
                cv2.resize(full.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
                > 0
            )
        if not full.any():
            continue
        rows, cols = np.flatnonzero(full.any(axis=1)), np.flatnonzero(full.any(axis=0))
        boxes[k] = cols[0], rows[0], cols[-1] + 1, rows[-1] + 1
        crop = full[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
        ids[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1][crop] = k + 1
        hulls[k] = hull_of(crop, boxes[k])
    return ids, boxes, hulls


def cache_coco(
    annotations: Path, photos: Path, folder: Path, progress: Progress | None = None
) -> list[str]:
    """Cache a COCO set with exact masks (categories 1 hold, 2 volume)."""
    progress = progress or Silent()
    folder.mkdir(parents=True, exist_ok=True)
    by_photo, _ = read_coco_masks(annotations)
    progress.step("exact masks", len(by_photo))
    for name, masks in by_photo.items():
        progress.advance()
        flat = name.replace("/", "_")
        if (folder / f"{flat}.labels.npz").is_file():
            continue
        image, _ = _read_photo(photos / name)
        ids, boxes, hulls = _paint_masks(masks, image.shape[1], image.shape[0])
        keep = np.flatnonzero(boxes[:, 2] > boxes[:, 0])
        number = np.zeros(len(masks) + 1, np.int16)
        number[keep + 1] = np.arange(1, len(keep) + 1)
        labels = np.array([m.label for m in masks], dtype=np.int64)[keep]
        _store(
            folder,
            Sample(flat, image, number[ids], labels, boxes[keep].astype(np.float32), hulls[keep]),
        )
    return [name.replace("/", "_") for name in by_photo]


def open_cache(folder: Path, name: str) -> Sample:
    """One cached photo; the arrays stay on disk until they are touched."""
    stem = folder / name
    try:
        with np.load(f"{stem}.labels.npz") as arrays:
            labels, boxes, hulls = arrays["labels"], arrays["boxes"], arrays["hulls"]
        image = np.load(f"{stem}.image.npy", mmap_mode="r")
        ids = np.load(f"{stem}.ids.npy", mmap_mode="r")
    except FileNotFoundError as error:
        raise InputError(
            f"{stem}: not in the training cache ({error.filename} is missing)"
        ) from error
    return Sample(name, image, ids, labels, boxes, hulls)
