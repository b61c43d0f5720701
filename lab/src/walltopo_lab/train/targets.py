"""Training targets of a crop: heat, votes and masks with their loss weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.train.augment import Crop
from walltopo_lab.train.cache import UNDECIDED, ignored_at

_CLASSES = 2
_MIN_SEEN = 0.3  # objects with a smaller visible share are ignored in the loss
_MIN_SIDE = 4.0  # px; smaller objects are ignored in the loss


@dataclass(frozen=True, eq=False)
class Targets:
    """The targets of one crop of S px; C = 2 classes.

    Parameters
    ----------
    heat : (C, S/4, S/4) float32 in [0, 1]; exactly 1 at object centres.
    heat_weight : (C, S/4, S/4) float32, 0 where undecided.
    votes : (4 C, S/4, S/4) float32, distances to left, top, right, bottom in pixels.
    vote_weight : (C, S/4, S/4) float32, 0 where no pixel votes.
    mask : (C, S/2, S/2) float32, 0 or 1.
    mask_weight : (C, S/2, S/2) float32.
    """

    heat: NDArray[np.float32]
    heat_weight: NDArray[np.float32]
    votes: NDArray[np.float32]
    vote_weight: NDArray[np.float32]
    mask: NDArray[np.float32]
    mask_weight: NDArray[np.float32]


def _draw_peak(
    heat: NDArray[np.float32], middle: NDArray[np.float64], size: NDArray[np.float64]
) -> None:
    """Raise `heat` to a Gaussian of the object's proportions at its centre (cells of 4 px)."""
    rows, cols = heat.shape
    cx, cy = min(int(middle[0] / 4), cols - 1), min(int(middle[1] / 4), rows - 1)
    sx, sy = np.maximum(size / 4 * 0.14, 0.45)
    rx, ry = int(3 * sx) + 1, int(3 * sy) + 1
    x0, x1 = max(0, cx - rx), min(cols, cx + rx + 1)
    y0, y1 = max(0, cy - ry), min(rows, cy + ry + 1)
    gx = np.exp(-((np.arange(x0, x1) - cx) ** 2) / (2 * sx * sx))
    gy = np.exp(-((np.arange(y0, y1) - cy) ** 2) / (2 * sy * sy))
    window = heat[y0:y1, x0:x1]
    np.maximum(window, (gy[:, None] * gx[None, :]).astype(np.float32), out=window)


def _known_classes(ids: NDArray[np.int16]) -> NDArray[np.float32]:
    """Return (C, h, w) 1 where the instance map states whether the class is present."""
    return np.stack([~ignored_at(ids, c + 1) for c in range(_CLASSES)]).astype(np.float32)


def make_targets(crop: Crop) -> Targets:
    """Return the targets of one crop; small objects win the pixels shared with large ones."""
    side = crop.image.shape[0]
    cells, half = side // 4, side // 2
    heat = np.zeros((_CLASSES, cells, cells), np.float32)
    votes = np.zeros((4 * _CLASSES, cells, cells), np.float32)
    vote_weight = np.zeros_like(heat)
    coarse = crop.ids[2::4, 2::4]
    fine = crop.ids[1::2, 1::2]
    heat_weight = _known_classes(coarse)
    mask = np.zeros((_CLASSES, half, half), np.float32)
    mask_weight = _known_classes(fine) * (fine != UNDECIDED)
    class_of = np.concatenate([[0], crop.labels])
    fine_class = np.where(fine > 0, class_of[np.maximum(fine, 0)], 0)
    for c in range(_CLASSES):
        mask[c] = fine_class == c + 1
    sizes = crop.boxes[:, 2:] - crop.boxes[:, :2]
    areas = np.sqrt(np.prod(sizes, axis=1))
    # Small objects have few pixels: weight those more, or the sum would ignore them.
    boost = np.concatenate([[1.0], np.clip(40.0 / np.maximum(areas, 1.0), 0.7, 4.0)])
    mask_weight *= boost[np.maximum(fine, 0)].astype(np.float32)
    centre = np.arange(cells) * 4 + 2.0
    for k in np.argsort(-areas, kind="stable"):
        if crop.seen[k] <= 0.02 or sizes[k].min() <= 0:
            continue
        c = int(crop.labels[k]) - 1
        x0, y0, x1, y1 = crop.boxes[k]
        i0, i1 = int(y0 // 4), int(np.ceil(y1 / 4))
        j0, j1 = int(x0 // 4), int(np.ceil(x1 / 4))
        if crop.seen[k] < _MIN_SEEN or sizes[k].min() < _MIN_SIDE:
            heat_weight[c, i0:i1, j0:j1] = 0.0
            continue
        middle = (crop.boxes[k, :2] + crop.boxes[k, 2:]) / 2
        _draw_peak(heat[c], middle, sizes[k])
        ci, cj = min(int(middle[1] / 4), cells - 1), min(int(middle[0] / 4), cells - 1)
        heat[c, ci, cj] = 1.0
        heat_weight[c, ci, cj] = 1.0
        ys, xs = centre[i0:i1, None], centre[None, j0:j1]
        core = (np.abs(ys - middle[1]) < 0.25 * sizes[k, 1]) & (
            np.abs(xs - middle[0]) < 0.25 * sizes[k, 0]
        )
        voting = core | (coarse[i0:i1, j0:j1] == k + 1)
        voting[ci - i0, cj - j0] = True
        distances = np.stack(np.broadcast_arrays(xs - x0, ys - y0, x1 - xs, y1 - ys))
        window = votes[4 * c : 4 * c + 4, i0:i1, j0:j1]
        window[:, voting] = np.maximum(distances[:, voting], 0.5)
        weight = vote_weight[c, i0:i1, j0:j1]
        weight[voting] = 1.0 / np.sqrt(voting.sum())
    return Targets(heat, heat_weight, votes, vote_weight, mask, mask_weight)
