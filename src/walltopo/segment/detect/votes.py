"""Decode the three outputs of the shipped network (`walltopo_lab.train.net`) into objects.

A peak of the heat map is an object, and the vote at the peak is its first box. Every cell belongs
to the object whose box it votes for, and the votes of an object's cells are averaged to its final
box. The mask is taken from the mask output, within the object's cells and the cells beside them
that vote for no object. It is cut at the level at which it fills the box best. The score is the
heat at the peak times the square root of the mask confidence.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask
from walltopo.segment.detect.photo_detections import (
    PhotoDetections,
    box_iou,
    suppress_overlaps,
    tight_mask,
)

Floats = NDArray[np.float32]
_CELL = 4  # px of a heat or vote cell
_MAX_PEAKS = 2000  # the densest photo known has under 400 objects
_MIN_VOTE = 0.45  # minimum IoU of a cell's vote with the box it belongs to
# Levels of mask probability at which a mask may be cut: the default, unless another level fills
# the box better by `_LEVEL_MARGIN` of IoU. Votes place borders better than the mask output, which
# is faint on unfamiliar photos. Levels and the cells beside an object raised the AP50 of boxes
# around masks (mean of classes) from .60 to .67 and that of outlines from .27 to .31, on held-out
# photos (57 of hold-boxes/train, 25 of hold-polygons). Without the margin, rendered walls, whose
# masks are confident, lost AP.
_LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
_DEFAULT_LEVEL, _LEVEL_MARGIN = 0.5, 0.05


def vote_boxes(votes: Floats) -> NDArray[np.float64]:
    """Return boxes (C, h, w, 4) x0, y0, x1, y1 in pixels from votes (4 C, h, w) of distances."""
    channels, h, w = votes.shape
    split = votes.reshape(channels // 4, 4, h, w).astype(np.float64)
    x = (np.arange(w) * _CELL + _CELL / 2)[None, None, :]
    y = (np.arange(h) * _CELL + _CELL / 2)[None, :, None]
    left, top, right, bottom = split[:, 0], split[:, 1], split[:, 2], split[:, 3]
    return np.stack([x - left, y - top, x + right, y + bottom], axis=-1)


def _peaks(heat: Floats, threshold: float) -> tuple[NDArray[np.int64], ...]:
    """Return class, row and column of the local maxima above the threshold, highest first."""
    top = np.stack([cv2.dilate(layer, np.ones((3, 3), np.uint8)) for layer in heat])
    c, i, j = np.nonzero((heat >= top) & (heat > threshold))
    order = np.argsort(-heat[c, i, j], kind="stable")[:_MAX_PEAKS]
    return c[order], i[order], j[order]


def assign_cells(cells: NDArray[np.float64], boxes: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the (h, w) position of the box each cell (h, w, 4) votes for, -1 = none."""
    h, w = cells.shape[:2]
    best = np.full((h, w), _MIN_VOTE)
    owner = np.full((h, w), -1, np.int32)
    area = np.prod(cells[..., 2:] - cells[..., :2], axis=-1)
    for k, (x0, y0, x1, y1) in enumerate(boxes):
        j0, i0 = max(0, int(x0 / _CELL) - 1), max(0, int(y0 / _CELL) - 1)
        j1, i1 = min(w, int(x1 / _CELL) + 2), min(h, int(y1 / _CELL) + 2)
        window = cells[i0:i1, j0:j1]
        wide = np.minimum(window[..., 2], x1) - np.maximum(window[..., 0], x0)
        tall = np.minimum(window[..., 3], y1) - np.maximum(window[..., 1], y0)
        shared = np.maximum(wide, 0.0) * np.maximum(tall, 0.0)
        iou = shared / (area[i0:i1, j0:j1] + (x1 - x0) * (y1 - y0) - shared)
        better = iou > best[i0:i1, j0:j1]
        best[i0:i1, j0:j1][better] = iou[better]
        owner[i0:i1, j0:j1][better] = k
    return owner


def _average_votes(
    owner: NDArray[np.int32],
    cells: NDArray[np.float64],
    heat: Floats,
    mask: Floats,
    boxes: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean box of each object's votes (n, 4), and its mask confidence (n,).

    One vote is noisy; the mean, weighted by the heat, is not. On held-out photos the mean raised
    AP at 0.75 IoU from 0.15 to 0.22.
    """
    mine = owner >= 0
    index, weight = owner[mine], heat[mine].astype(np.float64)
    count = len(boxes)
    total = np.bincount(index, weight, count)
    known = total > 1e-6
    safe = np.where(known, total, 1.0)
    sums = [np.bincount(index, weight * cells[mine][:, k], count) for k in range(4)]
    mean_boxes = np.where(known[:, None], np.stack(sums, axis=1) / safe[:, None], boxes)
    h, w = owner.shape
    coarse = mask.reshape(h, 2, w, 2).mean(axis=(1, 3))
    confidence = np.bincount(index, weight * coarse[mine], count) / safe
    return mean_boxes, np.where(known, confidence, 0.0)


def confidence_of(
    mask: Floats,
    owner: NDArray[np.int32],
    k: int,
    box: NDArray[np.float64],
    scale: float,
    size: tuple[int, int],
) -> tuple[Floats, int, int] | None:
    """Return the mask confidence of one object in a window, and the window's column and row.

    Return None if the window contains no pixel of the photo.
    """
    width, height = size
    h, w = owner.shape
    j0, i0 = max(0, int(box[0] / _CELL) - 1), max(0, int(box[1] / _CELL) - 1)
    j1, i1 = min(w, int(box[2] / _CELL) + 2), min(h, int(box[3] / _CELL) + 2)
    x0, y0 = max(0, int(j0 * _CELL / scale)), max(0, int(i0 * _CELL / scale))
    x1 = min(width, int(np.ceil(j1 * _CELL / scale)))
    y1 = min(height, int(np.ceil(i1 * _CELL / scale)))
    if j1 <= j0 or i1 <= i0 or x1 <= x0 or y1 <= y0:
        return None
    window = owner[i0:i1, j0:j1]
    voted = (window == k).astype(np.uint8)
    beside = cv2.dilate(voted, np.ones((3, 3), np.uint8))
    mine = np.where(window < 0, beside, voted).astype(np.float32)
    field = mask[2 * i0 : 2 * i1, 2 * j0 : 2 * j1] * mine.repeat(2, axis=0).repeat(2, axis=1)
    # Photo pixel (x + 0.5) lies at (x + 0.5) * scale of the input, half that in the mask output.
    step = scale / 2
    matrix = np.array(
        [
            [step, 0, (x0 + 0.5) * step - 0.5 - 2 * j0],
            [0, step, (y0 + 0.5) * step - 0.5 - 2 * i0],
        ]
    )
    photo = cv2.warpAffine(
        field, matrix, (x1 - x0, y1 - y0), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return np.asarray(photo, np.float32), x0, y0


def fill_box(confidence: Floats, box: NDArray[np.float64]) -> NDArray[np.bool_] | None:
    """Return the largest connected component above the level that fills the box best.

    Return None if no component is found.

    Parameters
    ----------
    confidence : (h, w) mask confidence.
    box : (4,) in pixels of `confidence`.
    """
    best, found = -1.0, None
    for level in _LEVELS:
        count, parts, stats, _ = cv2.connectedComponentsWithStats(
            (confidence > level).view(np.uint8), connectivity=4
        )
        if count < 2:
            break
        part = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
        left, top, wide, tall = stats[part, :4]
        extent = np.array([[left, top, left + wide, top + tall]], np.float64)
        iou = float(box_iou(extent, box[None])[0, 0]) + _LEVEL_MARGIN * (level == _DEFAULT_LEVEL)
        if iou > best:
            best, found = iou, np.asarray(parts == part)
    return found


def _object_mask(
    window: tuple[Floats, int, int] | None,
    box: NDArray[np.float64],
    size: tuple[int, int],
    label: int,
    score: float,
) -> Mask | None:
    """Return the mask of one object with a box in photo pixels, or None if it has no pixel."""
    if window is None:
        return None
    confidence, x, y = window
    bitmap = fill_box(confidence, box - np.array([x, y, x, y]))
    return None if bitmap is None else tight_mask(bitmap, x, y, size, label, score)


def decode_votes(
    heat: Floats,
    votes: Floats,
    mask: Floats,
    threshold: float,
    scale: float,
    size: tuple[int, int],
    overlap: float = 0.5,
) -> PhotoDetections:
    """Return the objects of one photo.

    Parameters
    ----------
    heat : (C, H/4, W/4) float32 in [0, 1].
    votes : (4 C, H/4, W/4) float32, distances in input pixels.
    mask : (C, H/2, W/2) float32 in [0, 1].
    threshold : minimum score.
    scale : input pixels per photo pixel; the input's corner is the photo's corner.
    size : width and height of the photo in pixels.
    overlap : IoU above which a box suppresses a weaker box of its class.

    Returns
    -------
    The objects in photo pixels; labels are class numbers from 1.
    """
    c, i, j = _peaks(heat, threshold)
    cells = vote_boxes(votes)
    limit = np.array([size[0], size[1], size[0], size[1]]) * scale
    boxes = np.clip(cells[c, i, j], 0.0, limit)
    scores = heat[c, i, j].astype(np.float64)
    kept = suppress_overlaps(boxes, scores, c + 1, overlap)
    kept = kept[np.prod(boxes[kept, 2:] - boxes[kept, :2], axis=1) > 1.0]
    c, boxes, scores = c[kept], boxes[kept], scores[kept]
    kept_members: list[int] = []
    masks: list[Mask] = []
    for k in np.unique(c):
        members = np.flatnonzero(c == k)
        owner = assign_cells(cells[k], boxes[members])
        mean_boxes, confidence = _average_votes(owner, cells[k], heat[k], mask[k], boxes[members])
        boxes[members] = np.clip(mean_boxes, 0.0, limit)
        scores[members] = np.minimum(scores[members] * np.sqrt(confidence), 1.0)
        for n, member in enumerate(members):
            if scores[member] < threshold:
                continue
            box = boxes[member]
            window = confidence_of(mask[k], owner, n, box, scale, size)
            found = _object_mask(window, box / scale, size, int(k) + 1, float(scores[member]))
            if found is not None:
                kept_members.append(int(member))
                masks.append(found)
    order = np.argsort(-scores[kept_members], kind="stable")
    index = np.asarray(kept_members, dtype=np.int64)[order]
    return PhotoDetections(
        size[0],
        size[1],
        boxes[index] / scale,
        scores[index],
        np.asarray(c[index] + 1, dtype=np.int64),
        tuple(masks[n] for n in order),
    )
