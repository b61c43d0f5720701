"""Detection of faults in a labelled set: bad boxes, empty objects, duplicates, rotated labels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_lab.datasets.model import Dataset, Photo

Floats = NDArray[np.float64]

# Relative boxes (n, 4: x0, y0, x1, y1) under each rotation or reflection of the labels.
# A 90 degree turn swaps the axes, as when EXIF rotation was applied to photo or labels alone.
TURNS: dict[str, Callable[[Floats], Floats]] = {
    "as they are": lambda b: b,
    "turned by 180°": lambda b: 1 - b[:, [2, 3, 0, 1]],
    "mirrored left-right": lambda b: np.c_[1 - b[:, 2], b[:, 1], 1 - b[:, 0], b[:, 3]],
    "mirrored top-bottom": lambda b: np.c_[b[:, 0], 1 - b[:, 3], b[:, 2], 1 - b[:, 1]],
    "turned by 90° clockwise": lambda b: np.c_[1 - b[:, 3], b[:, 0], 1 - b[:, 1], b[:, 2]],
    "turned by 90° anticlockwise": lambda b: np.c_[b[:, 1], 1 - b[:, 2], b[:, 3], 1 - b[:, 0]],
}
_LONG_SIDE = 480
# Minimum score gain over the labels as they are for a turn to be reported. Chosen on labels of the
# train part that were rotated on purpose; docs/datasets.md lists detection and miss rates.
MARGIN = 0.2
_MIN_BOXES = 6
_LARGE_BOX = 0.05  # share of the photo


@dataclass(frozen=True)
class Finding:
    """One fault of a set.

    Parameters
    ----------
    photo : name of the photo.
    kind : outside, empty, tiny, duplicate, turned, unreadable.
    text : description of the fault for the user.
    annotation : index of the object in its photo, None for a fault of the whole photo.
    """

    photo: str
    kind: str
    text: str
    annotation: int | None = None


def _relative_boxes(photo: Photo) -> Floats:
    """Return (n, 4) x0, y0, x1, y1 relative to the photo's size."""
    xywh = np.array([a.box for a in photo.annotations], dtype=np.float64).reshape(-1, 4)
    corners = np.concatenate([xywh[:, :2], xywh[:, :2] + xywh[:, 2:]], axis=1)
    return corners / np.array([photo.width, photo.height] * 2)


def _check_boxes(photo: Photo) -> list[Finding]:
    found: list[Finding] = []
    boxes = _relative_boxes(photo)
    seen: dict[tuple[int, ...], int] = {}
    for k, annotation in enumerate(photo.annotations):
        x0, y0, x1, y1 = boxes[k]
        slack = 1.5 / min(photo.width, photo.height)  # rounding in the label file is no fault
        size = f"{annotation.box[2]:.0f}x{annotation.box[3]:.0f} px"
        if x1 <= 0 or y1 <= 0 or x0 >= 1 or y0 >= 1:
            found.append(Finding(photo.name, "outside", "the box lies outside the photo", k))
        elif min(x0, y0) < -slack or max(x1, y1) > 1 + slack:
            found.append(Finding(photo.name, "outside", "the box leaves the photo", k))
        if any(_leaves_photo(polygon, photo) for polygon in annotation.polygons):
            found.append(Finding(photo.name, "outside", "the outline leaves the photo", k))
        if annotation.box[2] <= 0 or annotation.box[3] <= 0:
            found.append(Finding(photo.name, "empty", f"the box has no area ({size})", k))
        elif min(annotation.box[2:]) < 3:
            found.append(Finding(photo.name, "tiny", f"the box is {size}", k))
        if annotation.mask is not None and annotation.mask.area == 0:
            found.append(Finding(photo.name, "empty", "the mask has no pixel", k))
        key = (annotation.label, *(round(v) for v in annotation.box))
        if key in seen:
            found.append(Finding(photo.name, "duplicate", f"the same as object {seen[key]}", k))
        seen.setdefault(key, k)
    return found


def _leaves_photo(polygon: Floats, photo: Photo) -> bool:
    """Return whether an outline leaves its photo by more than is rounded in label files."""
    return bool((polygon < -1.5).any() or (polygon > np.array(photo.size) + 1.5).any())


def _saliency(photo: Photo) -> Floats:
    """Return (h, w) saliency of each pixel: colour contrast to its wide surroundings, and edges.

    The map has zero mean and unit standard deviation.
    """
    import cv2

    pixels = photo.pixels()
    factor = _LONG_SIDE / max(pixels.shape[:2])
    size = (max(8, round(pixels.shape[1] * factor)), max(8, round(pixels.shape[0] * factor)))
    lab = cv2.cvtColor(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2LAB)
    lab = lab.astype(np.float32)
    wide = cv2.GaussianBlur(lab, (0, 0), max(size) / 12)
    colour = np.linalg.norm(cv2.GaussianBlur(lab, (0, 0), 1.5) - wide, axis=2)
    edges = np.hypot(
        cv2.Sobel(lab[..., 0], cv2.CV_32F, 1, 0), cv2.Sobel(lab[..., 0], cv2.CV_32F, 0, 1)
    )
    edges = cv2.GaussianBlur(edges, (0, 0), 3)
    total = sum((m - m.mean()) / (m.std() + 1e-6) for m in (np.minimum(colour, 60), edges))
    result = np.asarray(total, dtype=np.float64)
    return (result - result.mean()) / (result.std() + 1e-9)


def turned_boxes(photo: Photo, turn: str) -> Floats:
    """Return (n, 4) x0, y0, x1, y1 relative to the photo's size, under one of `TURNS`."""
    return np.clip(TURNS[turn](_relative_boxes(photo)), 0, 1)


def _small_boxes(photo: Photo) -> NDArray[np.int64]:
    """Return the indices of the boxes that are small relative to the photo."""
    boxes = _relative_boxes(photo)
    return np.flatnonzero(np.abs(np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)) < _LARGE_BOX)


def turn_scores(photo: Photo) -> dict[str, float]:
    """Return how well the labels fit the photo under each turn.

    Each box has the same weight: its mean saliency minus that of the ring around it. Boxes of more
    than 1/20 of the photo are left out: a volume resembles the wall around it.

    Raises
    ------
    InputError : the photo cannot be read.
    """
    import cv2

    interest = _saliency(photo)
    height, width = interest.shape
    sums = np.asarray(cv2.integral(interest), dtype=np.float64)
    size = np.array([width, height, width, height])
    small = _small_boxes(photo)
    scores: dict[str, float] = {}
    for turn in TURNS:
        boxes = turned_boxes(photo, turn)[small] * size
        half = np.maximum(boxes[:, 2:] - boxes[:, :2], 2) / 2
        middle = (boxes[:, :2] + boxes[:, 2:]) / 2
        inner, inner_area = _box_sums(sums, middle - half, middle + half)
        outer, outer_area = _box_sums(sums, middle - 2 * half, middle + 2 * half)
        ring = (outer - inner) / np.maximum(outer_area - inner_area, 1)
        scores[turn] = float(np.mean(inner / inner_area - ring)) if len(small) else 0.0
    return scores


def _box_sums(sums: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Return the sum and number (at least 1) of pixels in boxes, from an integral image."""
    top = np.array([sums.shape[1], sums.shape[0]]) - 1
    a = np.clip(np.floor(low).astype(np.int64), 0, top - 1)
    b = np.clip(np.ceil(high).astype(np.int64), a + 1, top)
    total = sums[b[:, 1], b[:, 0]] - sums[a[:, 1], b[:, 0]]
    total += sums[a[:, 1], a[:, 0]] - sums[b[:, 1], a[:, 0]]
    return total, np.prod(b - a, axis=1).astype(np.float64)


def _check_picture(photo: Photo) -> list[Finding]:
    """Return the faults of a photo's picture: missing, unreadable, or unlike its labels."""
    try:
        photo.check_size()
        return _check_turn(photo) if len(_small_boxes(photo)) >= _MIN_BOXES else []
    except InputError as error:
        return [Finding(photo.name, "unreadable", error.message)]


def _check_turn(photo: Photo) -> list[Finding]:
    scores = turn_scores(photo)
    best = max(scores, key=lambda turn: scores[turn])
    gain = scores[best] - scores["as they are"]
    if gain < MARGIN:
        return []
    return [Finding(photo.name, "turned", f"the labels fit better {best} (by {gain:.2f})")]


def check_dataset(dataset: Dataset, pictures: bool = True) -> list[Finding]:
    """Return all faults of a set, photo by photo.

    Parameters
    ----------
    pictures : also open each photo; check its size, and for labels that are rotated to it.
    """
    found: list[Finding] = []
    for photo in dataset.photos:
        found += _check_boxes(photo)
        if pictures:
            found += _check_picture(photo)
    return found
