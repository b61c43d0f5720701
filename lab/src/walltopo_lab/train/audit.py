"""Detection of photos whose labels do not fit the image, with a half-trained network.

Some sets contain photos that were rotated or mirrored after labelling. A network trained on the
other photos predicts the true positions, which such labels contradict.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.segment.detect.photo_detections import box_iou
from walltopo_lab.train.cache import open_cache
from walltopo_lab.train.choose import detect_with
from walltopo_lab.train.net import VoteNet

Boxes = NDArray[np.float64]
_IOU = 0.35  # enough for a box and an object to match
_SURE = 0.3  # score above which detections of the half-trained network are used

# Possible rotations and reflections of a photo relative to its labels, in relative coordinates.
TURNS: dict[str, Callable[[Boxes], Boxes]] = {
    "as labelled": lambda p: p,
    "mirrored": lambda p: np.stack([1 - p[..., 0], p[..., 1]], axis=-1),
    "upside down mirrored": lambda p: np.stack([p[..., 0], 1 - p[..., 1]], axis=-1),
    "turned 180": lambda p: 1 - p,
    "turned 90": lambda p: np.stack([1 - p[..., 1], p[..., 0]], axis=-1),
    "turned 270": lambda p: np.stack([p[..., 1], 1 - p[..., 0]], axis=-1),
    "transposed": lambda p: np.stack([p[..., 1], p[..., 0]], axis=-1),
    "transposed back": lambda p: np.stack([1 - p[..., 1], 1 - p[..., 0]], axis=-1),
}


@dataclass(frozen=True)
class Verdict:
    """The agreement of a photo's labels with the network.

    Parameters
    ----------
    agreement : F1 of matched boxes and detections, with the labels as they are.
    turn, turned : the turn of `TURNS` with the best agreement, and that agreement.
    wrong : whether to exclude the photo from training.
    """

    name: str
    agreement: float
    turn: str
    turned: float
    wrong: bool


def turn_boxes(boxes: Boxes, turn: str) -> Boxes:
    """Return relative boxes (n, 4) after one of `TURNS`."""
    corners = TURNS[turn](boxes.reshape(-1, 2, 2))
    return np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)


def _agreement(boxes: Boxes, found: Boxes) -> float:
    if len(boxes) == 0 or len(found) == 0:
        return 0.0
    overlap = box_iou(boxes, found)
    met = (overlap.max(axis=1) > _IOU).sum() + (overlap.max(axis=0) > _IOU).sum()
    return float(met / (len(boxes) + len(found)))


def box_agreement(name: str, boxes: Boxes, found: Boxes) -> Verdict:
    """Return the agreement of labelled and detected boxes, (n, 4) relative to the photo's size."""
    scores = {turn: _agreement(turn_boxes(boxes, turn), found) for turn in TURNS}
    best = max(scores, key=lambda turn: scores[turn])
    plain = scores["as labelled"]
    turned = best != "as labelled" and scores[best] > max(0.25, 2 * plain)
    # Labels that match under no turn, despite many detections, were shifted or belong to another
    # photo.
    foreign = min(len(boxes), len(found)) >= 8 and max(scores.values()) < 0.12
    return Verdict(name, plain, best, scores[best], turned or foreign)


def audit(
    net: VoteNet, folder: Path, names: Sequence[str], progress: Progress, size: int = 800
) -> list[Verdict]:
    """Return a verdict on each cached photo."""
    net.eval()
    progress.step("labels against pictures", len(names))
    verdicts = []
    for name in names:
        sample = open_cache(folder, name)
        found = detect_with(net, sample, _SURE, size)
        height, width = sample.image.shape[:2]
        extent = np.array([width, height, width, height], dtype=np.float64)
        verdicts.append(box_agreement(name, sample.boxes / extent, found.boxes / extent))
        progress.advance()
    return verdicts
