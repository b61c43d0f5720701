"""Refinement of rough masks from the photo by a `Refiner`; includes GrabCut."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, Progress, Silent
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.shapes import ellipse, mask_of

Image = NDArray[np.uint8]

# Maps a photo (h, w, 3 sRGB), its rough masks, and which of them are only boxes to a refined mask
# each; None without a plausible result. All masks of a photo are passed at once, because networks
# encode the photo once.
Refiner = Callable[[Image, Sequence[Mask], Sequence[bool]], Sequence[Mask | None]]

AGREE_SHAPE = 0.6
AGREE_BOX = 0.35
_LONG_SIDE = 160  # px of the window in which GrabCut runs; a larger one costs time and gains little


def mask_iou(a: Mask, b: Mask) -> float:
    """Return the intersection over union of two masks of the same image size."""
    x0, y0 = min(a.x, b.x), min(a.y, b.y)
    x1 = max(a.x + a.bitmap.shape[1], b.x + b.bitmap.shape[1])
    y1 = max(a.y + a.bitmap.shape[0], b.y + b.bitmap.shape[0])
    boards = []
    for mask in (a, b):
        board = np.zeros((y1 - y0, x1 - x0), dtype=np.bool_)
        h, w = mask.bitmap.shape
        board[mask.y - y0 : mask.y - y0 + h, mask.x - x0 : mask.x - x0 + w] = mask.bitmap
        boards.append(board)
    union = np.count_nonzero(boards[0] | boards[1])
    return float(np.count_nonzero(boards[0] & boards[1]) / union) if union else 0.0


def inner_points(mask: Mask, count: int = 3) -> NDArray[np.float64]:
    """Return (count, 2) points x, y in pixels deep inside a mask and apart from each other.

    The first is the point furthest from the border. Each next one has the largest distance to the
    border and to all points before it. Small masks repeat a point.
    """
    import cv2

    inside = np.pad(mask.bitmap.astype(np.uint8), 1)
    points = np.zeros((count, 2))
    for k in range(count):
        depth = cv2.distanceTransform(inside, cv2.DIST_L2, 5)
        y, x = np.unravel_index(int(depth.argmax()), depth.shape)
        if depth[y, x] == 0:
            points[k:] = points[0]
            break
        points[k] = mask.x + x - 0.5, mask.y + y - 0.5
        inside[y, x] = 0
    return points


def grabcut(image: Image, masks: Sequence[Mask], are_boxes: Sequence[bool]) -> list[Mask | None]:
    """Return the result of `grabcut_one` for every mask of a photo: a `Refiner` without a model."""
    return [grabcut_one(image, m, b) for m, b in zip(masks, are_boxes, strict=True)]


def grabcut_one(image: Image, mask: Mask, is_box: bool) -> Mask | None:
    """Return the object's mask by colour, compared with the ring around it.

    Source: Rother, Kolmogorov, Blake, "GrabCut", SIGGRAPH 2004 (OpenCV's implementation). Inside a
    box, every pixel is undecided. Inside a mask, only a band along its border is undecided, as wide
    as a tenth of the mask's size.
    """
    import cv2

    h, w = mask.bitmap.shape
    if min(h, w) < 4:
        return None
    pad = max(6, round(0.35 * max(h, w)))
    x0, y0 = max(0, mask.x - pad), max(0, mask.y - pad)
    x1, y1 = min(mask.width, mask.x + w + pad), min(mask.height, mask.y + h + pad)
    window = image[y0:y1, x0:x1]
    rough = np.zeros(window.shape[:2], dtype=np.uint8)
    rough[mask.y - y0 : mask.y - y0 + h, mask.x - x0 : mask.x - x0 + w] = mask.bitmap
    factor = min(1.0, _LONG_SIDE / max(window.shape[:2]))
    size = (max(8, round(window.shape[1] * factor)), max(8, round(window.shape[0] * factor)))
    small = cv2.resize(window, size, interpolation=cv2.INTER_AREA)
    rough = np.asarray(cv2.resize(rough, size, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    seed = _grabcut_labels(rough, is_box)
    if not (seed == cv2.GC_BGD).any() or not np.isin(seed, (cv2.GC_FGD, cv2.GC_PR_FGD)).any():
        return None
    cv2.setRNGSeed(0)
    cv2.grabCut(
        np.ascontiguousarray(small[..., ::-1]),
        seed,
        (0, 0, 0, 0),
        np.zeros((1, 65)),
        np.zeros((1, 65)),
        4,
        cv2.GC_INIT_WITH_MASK,
    )
    inside = np.isin(seed, (cv2.GC_FGD, cv2.GC_PR_FGD)).astype(np.uint8)
    opened = cv2.morphologyEx(inside, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    smooth = np.asarray(opened, dtype=np.float32)
    large = np.asarray(cv2.resize(smooth, (x1 - x0, y1 - y0), interpolation=cv2.INTER_LINEAR))
    if not (large > 0.5).any():
        return None
    full = np.zeros((mask.height, mask.width), dtype=np.bool_)
    full[y0:y1, x0:x1] = _main_part(large > 0.5)
    return Mask.from_full(full, mask.label, mask.score)


def _grabcut_labels(rough: NDArray[np.uint8], is_box: bool) -> NDArray[np.uint8]:
    """Return GrabCut's labels: background, likely background, likely object, object."""
    import cv2

    seed = np.full(rough.shape, cv2.GC_BGD, dtype=np.uint8)
    if is_box:
        # The whole box may be object. If its corners counted as background, an object of one colour
        # would put that colour into the background model, and its mask would shrink.
        ys, xs = np.nonzero(rough)
        seed[rough > 0] = cv2.GC_PR_FGD
        centre = (int(xs.mean()), int(ys.mean()))
        axes = (max(1, round(0.42 * np.ptp(xs))), max(1, round(0.42 * np.ptp(ys))))
        core = (max(1, axes[0] // 3), max(1, axes[1] // 3))
        cv2.ellipse(seed, centre, core, 0, 0, 360, int(cv2.GC_FGD), -1)
        return seed
    band = max(2, round(0.1 * float(np.sqrt(rough.sum()))))
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * band + 1, 2 * band + 1))
    seed[cv2.dilate(rough, kernel) > 0] = cv2.GC_PR_BGD
    seed[rough > 0] = cv2.GC_PR_FGD
    seed[cv2.erode(rough, kernel) > 0] = cv2.GC_FGD
    return seed


def _main_part(bitmap: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the parts of at least a quarter of the largest part's area, with holes filled."""
    from scipy.ndimage import binary_fill_holes, label

    parts, count = label(bitmap)
    if count == 0:
        return bitmap
    sizes = np.bincount(parts.ravel())[1:]
    kept = 1 + np.flatnonzero(sizes >= sizes.max() / 4)
    return np.asarray(binary_fill_holes(np.isin(parts, kept)), dtype=np.bool_)


def refine_dataset(
    dataset: Dataset, refiner: Refiner, progress: Progress | None = None
) -> tuple[Dataset, int]:
    """Replace the mask of every object by the refiner's where the two agree.

    A box agrees with a mask at IoU >= .35 (a hold fills about two thirds of its box), a shape at
    IoU >= .6. If they disagree, a shape is kept, and a box becomes its inscribed ellipse.

    Returns
    -------
    The set with masks, and the number of masks from the refiner.
    """
    listener = progress or Silent()
    listener.step("refining", len(dataset.photos))
    taken = 0
    photos: list[Photo] = []
    for photo in dataset.photos:
        rough = [mask_of(annotation, photo) for annotation in photo.annotations]
        boxes = [not annotation.has_shape for annotation in photo.annotations]
        found = refiner(photo.pixels(), rough, boxes)
        rows: list[Annotation] = []
        for annotation, before, after in zip(photo.annotations, rough, found, strict=True):
            row, better = _accept_refined(annotation, before, after)
            rows.append(row)
            taken += better
        photos.append(photo.with_annotations(tuple(rows)))
        listener.advance()
    return Dataset(tuple(photos), dataset.classes), taken


def _accept_refined(
    annotation: Annotation, rough: Mask, found: Mask | None
) -> tuple[Annotation, bool]:
    is_box = not annotation.has_shape
    agree = AGREE_BOX if is_box else AGREE_SHAPE
    if found is not None and mask_iou(found, rough) >= agree:
        # Keep the box of a box label, because a person drew it.
        x, y, w, h = annotation.box if is_box else (float(v) for v in found.box)
        return replace(annotation, mask=found, polygons=(), box=(x, y, w, h)), True
    if not is_box:
        return annotation, False
    x, y, w, h = annotation.box
    oval = (ellipse(x + w / 2, y + h / 2, max(w / 2, 0.5), max(h / 2, 0.5)),)
    return replace(annotation, polygons=oval), False
