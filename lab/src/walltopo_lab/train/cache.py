"""The training cache: photos and instance maps as plain arrays for memory mapping.

Several runs share a cache. Each entry stores a key of its photo, its labels and its
preparation, so that a change of any of them rebuilds the entry.
"""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask, Progress, Silent
from walltopo.core.files import atomic_path, read_json
from walltopo.images.files import read_rgb
from walltopo.scans.coco_import import read_coco_masks
from walltopo_lab.train.pseudomask import HULL_POINTS, hull_of, paint_instances

PREPARED_VERSION = 1  # increase it when a code change alters the entries of unchanged labels
_LONGEST = 1600  # px; larger photos are downscaled before caching

# Negative values of an instance map.
UNDECIDED = -1  # inside a labelled box, where colour does not separate object from wall
IGNORED = -2  # excluded from the loss: the label was uncertain, or objects were not labelled
MAYBE_VOLUME = -3  # not a hold, but possibly a volume, because the set does not label volumes

DONT_KNOW = 0  # label of a category whose objects are painted as `IGNORED`


@dataclass(frozen=True, eq=False)
class Sample:
    """One labelled photo.

    Parameters
    ----------
    name : file name of the photo.
    image : (H, W, 3) uint8, BGR.
    ids : (H, W) int16; 0 background, k + 1 the k-th object, < 0 a constant above.
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

    def rgb(self) -> NDArray[np.uint8]:
        """Return the photo as (H, W, 3) uint8 RGB."""
        return np.asarray(cv2.cvtColor(np.asarray(self.image), cv2.COLOR_BGR2RGB), dtype=np.uint8)


def read_yolo_boxes(
    path: Path, width: int, height: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the file's class numbers (n,) and boxes (n, 4) x0, y0, x1, y1 in pixels.

    A segment (more than four numbers) is replaced by its bounding box.
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
    image = cv2.cvtColor(read_rgb(path), cv2.COLOR_RGB2BGR)  # the cache stores BGR
    scale = min(1.0, _LONGEST / max(image.shape[:2]))
    if scale < 1.0:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(image, dtype=np.uint8), scale


def _entry_key(photo: Path, *facts: object) -> str:
    """Return the key of an entry: preparation version, photo and label content."""
    text = json.dumps([PREPARED_VERSION, photo.stat().st_size, *facts])
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def _is_current(folder: Path, name: str, key: str) -> bool:
    path = folder / f"{name}.labels.npz"
    if not path.is_file():
        return False
    with np.load(path) as arrays:
        return "key" in arrays and str(arrays["key"]) == key


def store_sample(folder: Path, sample: Sample, key: str) -> None:
    """Write an entry; the file with its key is last, so that a killed run leaves no valid entry."""
    stem = folder / sample.name
    Path(f"{stem}.labels.npz").unlink(missing_ok=True)
    np.save(f"{stem}.image.npy", sample.image)
    np.save(f"{stem}.ids.npy", sample.ids)
    with atomic_path(Path(f"{stem}.labels.npz")) as temporary, temporary.open("wb") as file:
        np.savez(file, labels=sample.labels, boxes=sample.boxes, hulls=sample.hulls, key=key)


def _store_boxes(
    photo: Path,
    folder: Path,
    key: str,
    rows: tuple[NDArray[np.int64], NDArray[np.float64]],
    volumes_labelled: bool,
) -> str:
    """Cache a photo with labels (n,) and relative boxes (n, 4); return a line about its masks."""
    image, _ = _read_photo(photo)
    height, width = image.shape[:2]
    extent = np.array([width, height, width, height])
    known = rows[0] != DONT_KNOW
    labels, boxes = rows[0][known], rows[1][known] * extent
    ids, hulls, trusted = paint_instances(image, boxes)
    if not volumes_labelled:
        ids[ids == 0] = MAYBE_VOLUME
    for x0, y0, x1, y1 in np.clip(rows[1][~known] * extent, 0, extent).round().astype(int):
        region = ids[y0:y1, x0:x1]
        region[region <= 0] = IGNORED
    boxes = np.clip(boxes, 0, extent).astype(np.float32)
    store_sample(folder, Sample(photo.name, image, ids, labels, boxes, hulls), key)
    return f"{photo.name}: {trusted} of {len(boxes)} masks told by colour"


def cache_yolo(
    dataset: Path, folder: Path, progress: Progress | None = None, volumes_labelled: bool = True
) -> list[str]:
    """Cache a YOLO folder (`images/`, `labels/`), with pseudo-masks from its boxes.

    Entries that are up to date are kept. Returns the cached names.

    Parameters
    ----------
    volumes_labelled : False for a set that labels only holds.
    """
    progress = progress or Silent()
    folder.mkdir(parents=True, exist_ok=True)
    photos = sorted(p for p in (dataset / "images").iterdir() if p.suffix.lower() in _PHOTOS)
    progress.step(f"{folder.name}: masks from boxes", len(photos))
    names = []
    for path in photos:
        progress.advance()
        labels_path = dataset / "labels" / f"{path.stem}.txt"
        if not labels_path.is_file():
            continue
        names.append(path.name)
        key = _entry_key(path, labels_path.read_text(), volumes_labelled)
        if _is_current(folder, path.name, key):
            continue
        classes, boxes = read_yolo_boxes(labels_path, 1, 1)
        summary = _store_boxes(path, folder, key, (classes + 1, boxes), volumes_labelled)
        progress.detail(summary)
    return names


def cache_boxes(
    annotations: Path,
    photos: Path,
    folder: Path,
    categories: Mapping[str, int],
    progress: Progress | None = None,
) -> list[str]:
    """Cache a COCO set that has only boxes, with pseudo-masks from them.

    Parameters
    ----------
    categories : category name to label: 1 hold, 2 volume, `DONT_KNOW`; others are background.
    """
    progress = progress or Silent()
    folder.mkdir(parents=True, exist_ok=True)
    data = read_json(annotations)
    names = {row["id"]: row["name"] for row in data["categories"]}
    by_image: dict[int, list[dict[str, Any]]] = defaultdict(list)
    for row in data["annotations"]:
        by_image[row["image_id"]].append(row)
    progress.step(f"{folder.name}: masks from boxes", len(data["images"]))
    for image in data["images"]:
        progress.advance()
        named = [(names[row["category_id"]], row["bbox"]) for row in by_image[image["id"]]]
        rows = [(categories[name], box) for name, box in named if name in categories]
        path = photos / image["file_name"]
        key = _entry_key(path, rows)
        if _is_current(folder, path.name, key):
            continue
        boxes = np.array([box for _, box in rows], dtype=np.float64).reshape(-1, 4)
        boxes[:, 2:] += boxes[:, :2]
        boxes /= [image["width"], image["height"]] * 2
        labels = np.array([label for label, _ in rows], dtype=np.int64)
        progress.detail(_store_boxes(path, folder, key, (labels, boxes), True))
    return [image["file_name"] for image in data["images"]]


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
    annotations: Path,
    photos: Path,
    folder: Path,
    progress: Progress | None = None,
    categories: Mapping[int, int] | None = None,
) -> list[str]:
    """Cache a COCO set with exact masks.

    Parameters
    ----------
    categories : category number to label: 1 hold, 2 volume, `DONT_KNOW`; others are
        background. By default 1 and 2 are hold and volume.
    """
    progress = progress or Silent()
    folder.mkdir(parents=True, exist_ok=True)
    categories = categories or {1: 1, 2: 2}
    by_photo, _ = read_coco_masks(annotations)
    written = hashlib.blake2b(annotations.read_bytes(), digest_size=12).hexdigest()
    progress.step(f"{folder.name}: exact masks", len(by_photo))
    for name, masks in by_photo.items():
        progress.advance()
        flat = name.replace("/", "_")
        key = _entry_key(photos / name, written, sorted(categories.items()))
        if _is_current(folder, flat, key):
            continue
        image, _ = _read_photo(photos / name)
        known = [m for m in masks if m.label in categories]
        ids, boxes, hulls = _paint_masks(known, image.shape[1], image.shape[0])
        labels = np.array([categories[m.label] for m in known], dtype=np.int64)
        keep = np.flatnonzero((boxes[:, 2] > boxes[:, 0]) & (labels != DONT_KNOW))
        number = np.zeros(len(known) + 1, np.int16)
        number[1:][labels == DONT_KNOW] = IGNORED
        number[keep + 1] = np.arange(1, len(keep) + 1)
        kept = boxes[keep].astype(np.float32)
        store_sample(folder, Sample(flat, image, number[ids], labels[keep], kept, hulls[keep]), key)
    return [name.replace("/", "_") for name in by_photo]


def ignored_at(ids: NDArray[np.int16], label: int) -> NDArray[np.bool_]:
    """Return the pixels where an instance map does not state whether a class is present."""
    return (ids == IGNORED) | ((ids == MAYBE_VOLUME) & (label == 2))


def open_cache(folder: Path, name: str) -> Sample:
    """Return one cached photo; its arrays are memory-mapped."""
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
