"""Outlines of labelled boxes, drawn by a trained network in place of colour segmentation.

A network that votes for boxes outlines the object of a given box better than GrabCut: a pixel
belongs to the labelled box that it votes for, and the mask is cut at the level that fills the box
best. A mask whose extent disagrees with its box is not used; that object keeps its old mask.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from walltopo.segment.detect.onnx_detector import prepare
from walltopo.segment.detect.photo_detections import box_iou
from walltopo.segment.detect.votes import (
    assign_cells,
    confidence_of,
    decode_votes,
    fill_box,
    vote_boxes,
)
from walltopo_lab.train.cache import IGNORED, UNDECIDED, Sample
from walltopo_lab.train.net import CLASSES, VoteNet
from walltopo_lab.train.precision import fast_autocast
from walltopo_lab.train.pseudomask import hull_of

_SIZE = 1408  # px of the longer side
_LARGE = 240  # px in a look; larger objects are outlined in the second look
_SECOND = 0.6  # size of the second look
_MIN_EXTENT = 0.6  # IoU of a mask's extent with its labelled box
_UNSURE = 0.2  # mask confidence above which pixels beside an outline stay undecided
_MIN_PIXELS = 6
_SAME = 0.2  # IoU from which a detection is a labelled object
_SURE_UNLABELLED = 0.55  # score from which an object without a label is ignored in the loss


@dataclass(frozen=True, eq=False)
class _Look:
    """The outputs of one look: heat (C, h, w), votes (4 C, h, w), mask (C, 2 h, 2 w)."""

    heat: NDArray[np.float32]
    votes: NDArray[np.float32]
    mask: NDArray[np.float32]
    scale: float


@dataclass(frozen=True, eq=False)
class _Outline:
    """A mask in a window of the photo: confidence and bitmap (h, w), its column and row."""

    confidence: NDArray[np.float32]
    bitmap: NDArray[np.bool_]
    x: int
    y: int


@torch.no_grad()
def _mean_outputs(net: VoteNet, photo: NDArray[np.uint8], size: int) -> _Look:
    """Return the outputs for a photo, with the mask averaged over the mirrored photo."""
    scale = size / max(photo.shape[:2])
    device = next(net.parameters()).device
    sides = []
    for picture in (photo, np.ascontiguousarray(photo[:, ::-1])):
        tensor = torch.from_numpy(prepare(picture, scale)).to(device).permute(2, 0, 1)[None]
        with fast_autocast(device):
            heat, votes, mask = net(tensor.float().contiguous(memory_format=torch.channels_last))
        outputs = (torch.sigmoid(heat), votes, torch.sigmoid(mask))
        sides.append([output[0].float().cpu().numpy() for output in outputs])
    (heat_map, vote_map, mask_map), (_, _, other) = sides
    inner = round(photo.shape[1] * scale) // 2  # the padding stays at the right
    mask_map[:, :, :inner] = (mask_map[:, :, :inner] + other[:, :, :inner][:, :, ::-1]) / 2
    return _Look(heat_map, vote_map, mask_map, scale)


def _usable_outlines(looks: Sequence[_Look], sample: Sample) -> dict[int, _Outline]:
    """Return the usable outlines by object; `looks` are a large and a small one."""
    height, width = sample.ids.shape
    boxes = sample.boxes.astype(np.float64)
    sides = np.sqrt(np.prod(boxes[:, 2:] - boxes[:, :2], axis=1))
    made: dict[int, _Outline] = {}
    cells = [vote_boxes(look.votes) for look in looks]
    for c in range(len(CLASSES)):
        members = np.flatnonzero(sample.labels == c + 1)
        owners = [
            assign_cells(each[c], boxes[members] * look.scale)
            for each, look in zip(cells, looks, strict=True)
        ]
        for n, k in enumerate(members):
            number = int(sides[k] * looks[0].scale > _LARGE)
            look, owner = looks[number], owners[number]
            box = boxes[k] * look.scale
            window = confidence_of(look.mask[c], owner, n, box, look.scale, (width, height))
            outline = None if window is None else _fitting_outline(*window, boxes[k])
            if outline is not None:
                made[int(k)] = outline
    return made


def _fitting_outline(
    confidence: NDArray[np.float32], x: int, y: int, box: NDArray[np.float64]
) -> _Outline | None:
    """Return the outline that fills a box of the photo, or None if its extent disagrees."""
    bitmap = fill_box(confidence, box - np.array([x, y, x, y]))
    if bitmap is None:
        return None
    rows, cols = np.flatnonzero(bitmap.any(axis=1)), np.flatnonzero(bitmap.any(axis=0))
    extent = np.array([[cols[0] + x, rows[0] + y, cols[-1] + 1 + x, rows[-1] + 1 + y]], float)
    if box_iou(extent, box[None])[0, 0] < _MIN_EXTENT:
        return None
    return _Outline(confidence, bitmap, x, y)


def redraw(net: VoteNet, sample: Sample) -> Sample:
    """Return a photo with the masks of its labelled boxes drawn by a network.

    Objects that the network finds and nobody labelled become `IGNORED`.

    Parameters
    ----------
    net : a trained network, in eval mode.
    sample : a photo with pseudo-masks; labels and boxes stay as they are.
    """
    photo = sample.rgb()
    looks = [_mean_outputs(net, photo, size) for size in (_SIZE, round(_SIZE * _SECOND))]
    made = _usable_outlines(looks, sample)
    ids, hulls = _paint_outlines(sample, made)
    _ignore_unlabelled(ids, sample, looks[0])
    return replace(sample, ids=ids, hulls=hulls)


def _paint_outlines(
    sample: Sample, made: dict[int, _Outline]
) -> tuple[NDArray[np.int16], NDArray[np.float32]]:
    """Return the instance map and hulls: new outlines, else the old masks."""
    old = np.asarray(sample.ids)
    height, width = old.shape
    ids, hulls = np.zeros_like(old), np.array(sample.hulls)
    boxes = sample.boxes.astype(np.float64)
    areas = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    for k in np.argsort(-areas, kind="stable"):
        x0, y0, x1, y1 = np.clip(np.round(boxes[k]), 0, [width, height] * 2).astype(int)
        if x1 <= x0 or y1 <= y0:
            continue
        number = np.int16(k + 1)
        region, before = ids[y0:y1, x0:x1], old[y0:y1, x0:x1]
        inside = _in_box(made.get(int(k)), (x0, y0, x1, y1))
        if inside is None:
            region[before == UNDECIDED] = UNDECIDED
            region[before == number] = number
            continue
        confidence, bitmap = inside
        region[(confidence > _UNSURE) & ~bitmap & (region == 0)] = UNDECIDED
        region[bitmap] = number
        hulls[k] = hull_of(bitmap, boxes[k])
    ids[(old == IGNORED) & (ids == 0)] = IGNORED
    return ids, hulls


def _in_box(
    outline: _Outline | None, box: tuple[int, int, int, int]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]] | None:
    """Return confidence and bitmap of an outline in its box, or None if too little remains."""
    if outline is None:
        return None
    x0, y0, x1, y1 = box
    confidence = np.zeros((y1 - y0, x1 - x0), np.float32)
    bitmap = np.zeros(confidence.shape, np.bool_)
    h, w = outline.bitmap.shape
    left, top = max(x0, outline.x), max(y0, outline.y)
    right, bottom = min(x1, outline.x + w), min(y1, outline.y + h)
    if right <= left or bottom <= top:
        return None
    here = slice(top - y0, bottom - y0), slice(left - x0, right - x0)
    there = slice(top - outline.y, bottom - outline.y), slice(left - outline.x, right - outline.x)
    confidence[here], bitmap[here] = outline.confidence[there], outline.bitmap[there]
    return (confidence, bitmap) if bitmap.sum() >= _MIN_PIXELS else None


def _ignore_unlabelled(ids: NDArray[np.int16], sample: Sample, look: _Look) -> None:
    """Mark background as ignored where the network is sure of an object without a label."""
    height, width = ids.shape
    size = (width, height)
    found = decode_votes(look.heat, look.votes, look.mask, _SURE_UNLABELLED, look.scale, size)
    boxes = sample.boxes.astype(np.float64)
    if not len(found) or not len(boxes):
        return
    middles = (found.boxes[:, None, :2] + found.boxes[:, None, 2:]) / 2
    inside = (middles >= boxes[None, :, :2]) & (middles <= boxes[None, :, 2:])
    labelled = inside.all(axis=-1).any(axis=-1) | (box_iou(found.boxes, boxes).max(axis=1) >= _SAME)
    for box in found.boxes[~labelled]:
        x0, y0, x1, y1 = np.clip(np.round(box), 0, [width, height] * 2).astype(int)
        region = ids[y0:y1, x0:x1]
        region[region == 0] = IGNORED
