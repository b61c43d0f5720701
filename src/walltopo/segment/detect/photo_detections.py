"""The detections of one photo, and the rules that every detector shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask


@dataclass(frozen=True, eq=False)
class PhotoDetections:
    """The objects detected in an image of `width` x `height` pixels.

    Parameters
    ----------
    boxes : (n, 4) float64, x0, y0, x1, y1 in pixels, as the network predicts them.
    scores : (n,) float64 in (0, 1].
    labels : (n,) int64, >= 1.
    masks : n masks of the same image, or an empty tuple (box networks).
    """

    width: int
    height: int
    boxes: NDArray[np.float64]
    scores: NDArray[np.float64]
    labels: NDArray[np.int64]
    masks: tuple[Mask, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.scores)
        if self.boxes.shape != (n, 4) or self.labels.shape != (n,):
            raise InputError(
                f"detections: expected {n} boxes and labels, got {self.boxes.shape} "
                f"and {self.labels.shape}"
            )
        if self.masks and len(self.masks) != n:
            raise InputError(f"detections: {n} scores but {len(self.masks)} masks")

    def __len__(self) -> int:
        return len(self.scores)

    def pick(self, index: NDArray[np.int64] | Sequence[int]) -> PhotoDetections:
        """Return the detections at the given positions, in that order."""
        index = np.asarray(index, dtype=np.int64)
        masks = tuple(self.masks[i] for i in index) if self.masks else ()
        return PhotoDetections(
            self.width,
            self.height,
            self.boxes[index],
            self.scores[index],
            self.labels[index],
            masks,
        )


def box_iou(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (n, m) intersection over union of boxes (n, 4) and (m, 4), x0, y0, x1, y1."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    shared = np.prod(np.maximum(high - low, 0.0), axis=2)
    area_a = np.prod(np.maximum(a[:, 2:] - a[:, :2], 0.0), axis=1)
    area_b = np.prod(np.maximum(b[:, 2:] - b[:, :2], 0.0), axis=1)
    union = area_a[:, None] + area_b[None, :] - shared
    return shared / np.maximum(union, 1e-9)


def suppress_overlaps(
    boxes: NDArray[np.float64],
    scores: NDArray[np.float64],
    labels: NDArray[np.int64],
    same_class_iou: float = 0.5,
    other_class_iou: float = 0.8,
) -> NDArray[np.int64]:
    """Return the positions that survive non-maximum suppression, highest score first.

    A box is suppressed by a better box of its class with an IoU above `same_class_iou`, or by a
    better box of another class with an IoU above `other_class_iou`. The second limit is higher
    because a hold may lie on a volume, but no object is both.
    """
    order = np.argsort(-scores, kind="stable")
    boxes, labels = boxes[order], labels[order]
    overlap = box_iou(boxes, boxes)
    limit = np.where(labels[:, None] == labels[None, :], same_class_iou, other_class_iou)
    suppresses = overlap > limit
    alive = np.ones(len(order), dtype=np.bool_)
    for i in range(len(order)):
        if alive[i]:
            alive[i + 1 :] &= ~suppresses[i, i + 1 :]
    return np.asarray(order[alive], dtype=np.int64)


def tight_mask(
    bitmap: NDArray[np.bool_], x: int, y: int, size: tuple[int, int], label: int, score: float
) -> Mask | None:
    """Return a mask cropped to its set pixels, or None if no pixel is set.

    Parameters
    ----------
    bitmap : (h, w) bool; its top-left pixel is at column `x`, row `y` of the photo.
    size : width and height of the photo in pixels.
    """
    rows, cols = np.flatnonzero(bitmap.any(axis=1)), np.flatnonzero(bitmap.any(axis=0))
    if len(rows) == 0:
        return None
    crop = np.ascontiguousarray(bitmap[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1])
    return Mask(crop, x + int(cols[0]), y + int(rows[0]), size[0], size[1], label, score)
