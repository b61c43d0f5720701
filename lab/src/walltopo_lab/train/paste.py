"""Copy-paste augmentation with exactly outlined objects.

Ghiasi et al., "Simple Copy-Paste is a Strong Data Augmentation Method for Instance Segmentation"
(CVPR 2021). A pasted object is adjusted to the brightness of its new crop; a volume is pasted
with the holds on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo_lab.train.augment import Crop

_MIN_SIDE = 12  # px; smaller objects are not pasted
_MIN_SEEN = 0.9  # objects clipped by their crop would have false outlines
_MIN_LEFT = 0.4  # objects with a smaller visible share after pasting are ignored in the loss


@dataclass(frozen=True, eq=False)
class _Piece:
    """A cut-out object, with the objects on it.

    Parameters
    ----------
    image : (h, w, 3) uint8.
    ids : (h, w) int; 0 outside, k + 1 the k-th object of the piece.
    labels, boxes : of its objects; boxes (n, 4) in the piece's pixels.
    """

    image: NDArray[np.uint8]
    ids: NDArray[np.int64]
    labels: NDArray[np.int64]
    boxes: NDArray[np.float64]


def _shuffled_objects(source: Crop, rng: np.random.Generator) -> list[int]:
    """Return the objects of a crop in random order, volumes first because they are rare."""
    sides = source.boxes[:, 2:] - source.boxes[:, :2]
    usable = (source.seen >= _MIN_SEEN) & (sides.min(axis=1, initial=np.inf) >= _MIN_SIDE)
    order = rng.permutation(np.flatnonzero(usable))
    return sorted((int(k) for k in order), key=lambda k: source.labels[k] != 2)


def _cut_object(source: Crop, k: int) -> _Piece | None:
    """Cut out an object and all objects inside its outline; return None if nothing is visible."""
    mine = (source.ids == k + 1).astype(np.uint8)
    shapes, _ = cv2.findContours(mine, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    if not shapes:
        return None
    filled = cv2.drawContours(mine.copy(), shapes, -1, 1, cv2.FILLED) > 0
    ids = np.where(filled, np.maximum(source.ids, 0), 0)
    present = np.unique(ids)
    members = [int(v) - 1 for v in present[present > 0] if source.seen[v - 1] >= _MIN_SEEN]
    number = np.zeros(len(source.labels) + 1, np.int64)
    number[np.array(members, dtype=int) + 1] = np.arange(1, len(members) + 1)
    ids = number[ids]
    rows, cols = np.flatnonzero(filled.any(axis=1)), np.flatnonzero(filled.any(axis=0))
    y0, y1, x0, x1 = rows[0], rows[-1] + 1, cols[0], cols[-1] + 1
    boxes = source.boxes[members] - [x0, y0, x0, y0]
    boxes = np.clip(boxes, 0, [x1 - x0, y1 - y0] * 2)
    window = slice(y0, y1), slice(x0, x1)
    return _Piece(source.image[window], ids[window], source.labels[members], boxes)


def _paste_piece(target: Crop, piece: _Piece, light: float, rng: np.random.Generator) -> Crop:
    """Paste a piece at a random position; up to a quarter of it may lie beyond the border."""
    side = target.image.shape[0]
    h, w = piece.ids.shape
    y, x = (int(rng.integers(-n // 4, max(side - 3 * n // 4, 1 - n // 4))) for n in (h, w))
    top, left, bottom, right = max(0, -y), max(0, -x), min(h, side - y), min(w, side - x)
    here = slice(y + top, y + bottom), slice(x + left, x + right)
    part = slice(top, bottom), slice(left, right)
    image, ids = target.image.copy(), target.ids.copy()
    around = image[max(0, y - h // 2) : y + 2 * h, max(0, x - w // 2) : x + 2 * w]
    gain = float(np.clip(around.mean() / max(light, 1.0), 0.5, 2.0))
    soft = cv2.GaussianBlur((piece.ids > 0).astype(np.float32), (3, 3), 0)[part][..., None]
    lit = np.clip(piece.image[part].astype(np.float32) * gain, 0, 255)
    image[here] = (image[here] * (1 - soft) + lit * soft).astype(np.uint8)
    shown = piece.ids[part]
    ids[here] = np.where(shown > 0, shown + len(target.labels), ids[here])
    whole = piece.boxes + [x, y, x, y]
    clipped = np.clip(whole, 0, side)
    areas = [np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) for boxes in (clipped, whole)]
    seen = areas[0] / np.maximum(areas[1], 1e-6)
    return Crop(
        image,
        ids.astype(np.int16),
        np.concatenate([target.labels, piece.labels]),
        np.concatenate([target.boxes, clipped]),
        np.concatenate([target.seen, seen]),
    )


def _without_hidden(crop: Crop, before: Crop) -> Crop:
    """Mark objects of `before` as little visible if pasted objects hide most of them."""
    count = len(before.labels) + 1
    old = np.bincount(np.maximum(before.ids, 0).ravel(), minlength=count)[1:]
    new = np.bincount(np.maximum(crop.ids, 0).ravel(), minlength=count)[1:count]
    hidden = (old > 0) & (new < _MIN_LEFT * old)
    seen = crop.seen.copy()
    seen[: len(hidden)][hidden] = np.minimum(seen[: len(hidden)][hidden], 0.1)
    return replace(crop, seen=seen)


def paste_objects(target: Crop, source: Crop, count: int, rng: np.random.Generator) -> Crop:
    """Return a crop with up to `count` pasted objects of another crop.

    Parameters
    ----------
    source : a crop with exact outlines.
    """
    made, light = target, float(source.image.mean())
    for k in _shuffled_objects(source, rng)[:count]:
        piece = _cut_object(source, k)
        if piece is not None and len(piece.labels):
            made = _paste_piece(made, piece, light, rng)
    return _without_hidden(made, target)
