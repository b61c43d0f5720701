"""Agreement of two labellings of the same photos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_lab.datasets.model import Dataset, Photo
from walltopo_lab.datasets.shapes import mask_of


@dataclass(frozen=True)
class Comparison:
    """Agreement of a set with a reference set.

    Parameters
    ----------
    per_photo : photo name to its mean IoU over the classes in it (including the wall).
    per_class : class name to IoU over the pixels of all photos; "none" is the wall.
    miou : mean of `per_class`.
    miou_objects : mean of `per_class` without the wall.
    instance_iou : mean over the reference's objects of the IoU with the best object of the other
        set, regardless of class; 0 without any overlap.
    objects : number of the reference's objects.
    """

    per_photo: dict[str, float]
    per_class: dict[str, float]
    miou: float
    miou_objects: float
    instance_iou: float
    objects: int

    def as_dict(self) -> dict[str, Any]:
        return dict(self.__dict__)


def label_image(photo: Photo, numbers: dict[int, int]) -> NDArray[np.uint8]:
    """Return (height, width) the class of each pixel, 0 = none; small objects cover large ones."""
    image = np.zeros((photo.height, photo.width), dtype=np.uint8)
    masks = [mask_of(annotation, photo) for annotation in photo.annotations]
    for mask in sorted(masks, key=lambda m: -m.area):
        h, w = mask.bitmap.shape
        window = image[mask.y : mask.y + h, mask.x : mask.x + w]
        window[mask.bitmap] = numbers[mask.label]
    return image


def _best_overlaps(photo: Photo, other: Photo) -> list[float]:
    from faster_coco_eval.core import mask as rle

    from walltopo.scans.segmentation import encode_mask

    if not photo.annotations:
        return []
    if not other.annotations:
        return [0.0] * len(photo.annotations)
    mine = [encode_mask(mask_of(a, photo)) for a in photo.annotations]
    theirs = [encode_mask(mask_of(a, other)) for a in other.annotations]
    overlaps = np.asarray(rle.iou(theirs, mine, [0] * len(mine)))
    return [float(v) for v in overlaps.max(axis=0)]


def compare_sets(dataset: Dataset, reference: Dataset) -> Comparison:
    """Return the agreement of `dataset` with `reference` on the photos that both contain.

    Classes are matched by name, photos by the stem of their name.

    Raises
    ------
    InputError : no photo in common, or sizes differ.
    """
    names = sorted({*dataset.classes.values(), *reference.classes.values()})
    if len(names) > 250:
        raise InputError(f"{len(names)} classes; at most 250 can be compared")
    number = {name: k for k, name in enumerate(names, start=1)}
    stem = {photo.name.rsplit(".", 1)[0]: photo for photo in dataset.photos}
    size = len(names) + 1
    total = np.zeros((size, size), dtype=np.int64)
    per_photo: dict[str, float] = {}
    overlaps: list[float] = []
    for photo in reference.photos:
        other = stem.get(photo.name.rsplit(".", 1)[0])
        if other is None:
            continue
        if (other.width, other.height) != (photo.width, photo.height):
            raise InputError(
                f"{photo.name}: {other.width}x{other.height} against {photo.width}x{photo.height}"
            )
        true = label_image(photo, {k: number[v] for k, v in reference.classes.items()})
        mine = label_image(other, {k: number[v] for k, v in dataset.classes.items()})
        cells = true.astype(np.int64) * size + mine
        table = np.bincount(cells.ravel(), minlength=size * size).reshape(size, size)
        total += table
        per_photo[photo.name] = float(np.mean(list(_iou(table).values())))
        overlaps += _best_overlaps(photo, other)
    if not per_photo:
        raise InputError("the two sets have no photo in common")
    iou = {("none", *names)[k]: v for k, v in _iou(total).items()}
    objects = [v for name, v in iou.items() if name != "none"]
    return Comparison(
        per_photo,
        iou,
        float(np.mean(list(iou.values()))),
        float(np.mean(objects)) if objects else 0.0,
        float(np.mean(overlaps)) if overlaps else 0.0,
        len(overlaps),
    )


def _iou(table: NDArray[np.int64]) -> dict[int, float]:
    shared = np.diag(table)
    union = table.sum(axis=0) + table.sum(axis=1) - shared
    return {int(k): float(shared[k] / union[k]) for k in np.flatnonzero(union)}
