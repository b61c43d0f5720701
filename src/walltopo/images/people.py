"""Find people in a photo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import shipped_file
from walltopo.images.networks import Network, open_network

Image = NDArray[np.uint8]
Bitmap = NDArray[np.bool_]
Floats = NDArray[np.float64]

MODEL = "people.onnx"
# Minimum score of a person whose box is at least _LARGE of the photo's longer side, of a smaller
# one, and of one that is looked at again, enlarged, which boxes from _CANDIDATE on are: chosen on
# photos of `hold-boxes/train`, where many small boxes of a low score were holds.
_MIN_SCORE, _MIN_SCORE_SMALL, _MIN_SCORE_AGAIN = 0.5, 0.7, 0.6
_LARGE = 0.25
_CANDIDATE = 0.05
_MAX_SECOND_LOOKS = 5  # per photo
_ZOOM = 3.0  # side of a second look, in longer sides of the box
_MIN_ZOOMED = 60  # pixels; a smaller second look shows nothing new
# The longer side of the pictures that the network is shown, pixels: for people near and far.
_SIDES = (416, 736)
_SIDE_AGAIN = 416  # the same of second looks
_STRIDES = (8, 16, 32)  # pixels of a cell of the network's three grids
_PADDING = 114  # grey beside a picture whose sides are not multiples of 32
_SAME = 0.5  # share of the smaller box above which two boxes are one person
_SAME_AGAIN = 0.3  # the same of a box and its second look, because small boxes are inexact
# The outline is found in a picture of at most this many pixels along the box's longer side.
_OUTLINE_SIDE = 96
_MARGIN = 0.12  # of the box's sides: arms and feet reach beyond boxes
_ROUNDS = 2  # of GrabCut
# An outline outside these shares of its box is a failure; the whole box is taken instead.
_MIN_SHARE, _MAX_SHARE = 0.3, 0.98
_GROWTH = 0.05  # of the box's shorter side, by which an outline is widened


@dataclass(frozen=True)
class Person:
    """A person: `box` is x0, y0, x1, y1 in pixels, `score` in (0, 1]."""

    box: tuple[float, float, float, float]
    score: float


def find_people(photo: Image) -> list[Person]:
    """Return the people that a photo shows, the highest score first.

    Parameters
    ----------
    photo : (H, W, 3) uint8 RGB.
    """
    height, width = photo.shape[:2]
    boxes = np.concatenate([_find_in_part(photo, (0, 0, width, height), side) for side in _SIDES])
    large = (boxes[:, 2:4] - boxes[:, :2]).max(axis=1, initial=0.0) >= _LARGE * max(width, height)
    certain = boxes[:, 4] >= np.where(large, _MIN_SCORE, _MIN_SCORE_SMALL)
    found = list(boxes[certain])
    for box in _boxes_to_check(boxes[~certain], found):
        again = _find_in_part(photo, _square_around(box, width, height), _SIDE_AGAIN)
        again = again[again[:, 4] >= _MIN_SCORE_AGAIN]
        found += [row for row in again if _overlap_of_smaller(row, box) > _SAME_AGAIN]
    boxes = _distinct_boxes(np.array(found).reshape(-1, 5))
    boxes[:, [0, 2]] = boxes[:, [0, 2]].clip(0, width)
    boxes[:, [1, 3]] = boxes[:, [1, 3]].clip(0, height)
    return [
        Person((float(x0), float(y0), float(x1), float(y1)), float(score))
        for x0, y0, x1, y1, score in boxes
    ]


def people_mask(photo: Image, people: list[Person]) -> Bitmap:
    """Return the (H, W) pixels of the people in a photo, rather too many than too few."""
    mask = np.zeros(photo.shape[:2], dtype=np.bool_)
    for person in people:
        _add_outline(photo, person, mask)
    return mask


@cache
def _network() -> Network:
    return open_network(shipped_file(MODEL), threads=1)


@lru_cache(maxsize=8)
def _output_grid(height: int, width: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the (n, 2) cells of the network's outputs, and the (n, 1) pixels of a cell."""
    cells, strides = [], []
    for stride in _STRIDES:
        y, x = np.mgrid[: height // stride, : width // stride]
        cells.append(np.stack([x, y], axis=-1).reshape(-1, 2))
        strides.append(np.full((x.size, 1), stride))
    return np.concatenate(cells).astype(np.float32), np.concatenate(strides).astype(np.float32)


def _find_in_part(photo: Image, part: tuple[int, int, int, int], side: int) -> Floats:
    """Return (n, 5) boxes x0, y0, x1, y1 and scores of the people that the network may see.

    Parameters
    ----------
    part : x0, y0, x1, y1 of the rectangle to look at; the boxes are in pixels of the photo.
    side : longer side of the picture that the network is shown, pixels.
    """
    x0, y0, x1, y1 = part
    factor = side / max(y1 - y0, x1 - x0)
    height, width = (max(1, round(length * factor)) for length in (y1 - y0, x1 - x0))
    method = cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR
    shape = [-(-length // _STRIDES[-1]) * _STRIDES[-1] for length in (height, width)]
    padded = np.full((*shape, 3), _PADDING, dtype=np.uint8)
    padded[:height, :width] = cv2.resize(photo[y0:y1, x0:x1], (width, height), interpolation=method)
    values = np.ascontiguousarray(padded[..., ::-1].transpose(2, 0, 1)[None], dtype=np.float32)
    rows = _network().session.run(None, {"images": values})[0][0]
    score = rows[:, 4] * rows[:, 5]  # that an object is there, and that it is a person
    good = score >= _CANDIDATE
    cells, strides = _output_grid(*shape)
    rows, middle = rows[good], (rows[good, :2] + cells[good]) * strides[good]
    half = np.exp(rows[:, 2:4]) * strides[good] / 2
    boxes = np.concatenate([middle - half, middle + half], axis=1) / factor
    boxes += np.array([x0, y0, x0, y0])
    return np.concatenate([boxes, score[good, None]], axis=1).astype(np.float64)


def _boxes_to_check(boxes: Floats, found: Sequence[Floats]) -> list[Floats]:
    """Return the boxes that deserve a second look, the highest score first.

    Boxes of people found already, and of the same candidate, are left out.
    """
    chosen: list[Floats] = []
    for box in boxes[np.argsort(-boxes[:, 4], kind="stable")]:
        if len(chosen) == _MAX_SECOND_LOOKS:
            break
        if all(_overlap_of_smaller(box, other) <= _SAME for other in (*found, *chosen)):
            chosen.append(box)
    return chosen


def _square_around(box: Floats, width: int, height: int) -> tuple[int, int, int, int]:
    """Return a square around a box, within the photo."""
    side = int(max(_ZOOM * float((box[2:4] - box[:2]).max()), _MIN_ZOOMED))
    across, down = min(side, width), min(side, height)
    x0 = int(np.clip((box[0] + box[2] - across) / 2, 0, width - across))
    y0 = int(np.clip((box[1] + box[3] - down) / 2, 0, height - down))
    return x0, y0, x0 + across, y0 + down


def _overlap_of_smaller(a: Floats, b: Floats) -> float:
    """Return the common area of two boxes as a share of the smaller one."""
    sides = np.minimum(a[2:4], b[2:4]) - np.maximum(a[:2], b[:2])
    smaller = min(float(np.prod(box[2:4] - box[:2])) for box in (a, b))
    return float(np.prod(np.maximum(sides, 0.0))) / max(smaller, 1e-9)


def _distinct_boxes(boxes: Floats) -> Floats:
    """Return the boxes of distinct people, the highest score first; (n, 5) as in `_find_in_part`.

    The box of a person's part is joined to that of the person.
    """
    kept: list[NDArray[np.float64]] = []
    for box in boxes[np.argsort(-boxes[:, 4], kind="stable")]:
        for other in kept:
            if _overlap_of_smaller(box, other) > _SAME:
                other[:2] = np.minimum(box[:2], other[:2])
                other[2:4] = np.maximum(box[2:4], other[2:4])
                break
        else:
            kept.append(box.copy())
    return np.array(kept).reshape(-1, 5)


def _add_outline(photo: Image, person: Person, mask: Bitmap) -> None:
    """Add the outline of a person to a mask, in place."""
    height, width = mask.shape
    x0, y0, x1, y1 = person.box
    pad = _MARGIN * (x1 - x0), _MARGIN * (y1 - y0)
    left, top = max(0, int(x0 - pad[0])), max(0, int(y0 - pad[1]))
    right, bottom = min(width, int(x1 + pad[0]) + 1), min(height, int(y1 + pad[1]) + 1)
    crop = photo[top:bottom, left:right]
    inside = (round(x0) - left, round(y0) - top, round(x1) - left, round(y1) - top)
    mask[top:bottom, left:right] |= _person_pixels(crop, inside)


def _person_pixels(crop: Image, box: tuple[int, int, int, int]) -> Bitmap:
    """Return the (h, w) pixels of the person in `box`, which are those of the whole box if colours
    do not separate the person from what is behind."""
    height, width = crop.shape[:2]
    whole = np.zeros((height, width), dtype=np.uint8)
    whole[box[1] : box[3], box[0] : box[2]] = 1
    factor = min(1.0, _OUTLINE_SIDE / max(height, width))
    size = (max(8, round(width * factor)), max(8, round(height * factor)))
    small = np.asarray(cv2.resize(crop, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    inner = cv2.resize(whole, size, interpolation=cv2.INTER_NEAREST)
    if not inner.any() or inner.all():
        return whole.astype(np.bool_)
    labels = np.where(inner > 0, cv2.GC_PR_FGD, cv2.GC_BGD).astype(np.uint8)
    cv2.setRNGSeed(0)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(small, labels, (0, 0, 1, 1), *models, _ROUNDS, cv2.GC_INIT_WITH_MASK)
    found = (labels == cv2.GC_PR_FGD).astype(np.uint8)
    if not _MIN_SHARE <= found.sum() / inner.sum() <= _MAX_SHARE:
        return whole.astype(np.bool_)
    reach = max(1, round(_GROWTH * min(size)))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    grown = cv2.dilate(cv2.morphologyEx(found, cv2.MORPH_CLOSE, disc), disc)
    return np.asarray(cv2.resize(grown, (width, height), interpolation=cv2.INTER_LINEAR) > 0)
