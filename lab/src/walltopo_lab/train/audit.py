"""Photos whose labels do not fit the picture, found with a half-trained network.

Some sets hold photos that were turned or mirrored after their boxes were drawn. A network that
learned from the others finds the objects where they are, not where such labels say.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.segment.detect.found import box_iou
from walltopo_lab.train.cache import open_cache
from walltopo_lab.train.choose import detect_with
from walltopo_lab.train.net import VoteNet

Boxes = NDArray[np.float64]
_IOU = 0.35  # enough to say "this box is that object"
_SURE = 0.3  # score above which the half-trained network is believed

# Ways a photo may have been turned under its labels, in relative coordinates.
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
    """How well a photo's labels agree with the network.

    Parameters
    ----------
    agreement : share (F1) of boxes and detections that meet, labels as they are.
    turn, turned : the turn of `TURNS` under which they agree best, and how well.
    wrong : whether the photo should not be trained on.
    """

    name: str
    agreement: float
    turn: str
    turned: float
    wrong: bool


def turn_boxes(boxes: Boxes, turn: str) -> Boxes:
    """Relative boxes (n, 4) after one of `TURNS`."""
    corners = TURNS[turn](boxes.reshape(-1, 2, 2))
    return np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)


def _agreement(boxes: Boxes, found: Boxes) -> float:
    if len(boxes) == 0 or len(found) == 0:
        return 0.0
    overlap = box_iou(boxes, found)
    met = (overlap.max(axis=1) > _IOU).sum() + (overlap.max(axis=0) > _IOU).sum()
    return float(met / (len(boxes) + len(found)))


def judge(name: str, boxes: Boxes, found: Boxes) -> Verdict:
    """Compare labelled and found boxes, both (n, 4) relative to the photo's size."""
    scores = {turn: _agreement(turn_boxes(boxes, turn), found) for turn in TURNS}
    best = max(scores, key=lambda turn: scores[turn])
    plain = scores["as labelled"]
    turned = best != "as labelled" and scores[best] > max(0.25, 2 * plain)
    # Labels that fit nowhere although there is plenty to see were shifted or stem from elsewhere.
    foreign = min(len(boxes), len(found)) >= 8 and max(scores.values()) < 0.12
    return Verdict(name, plain, best, scores[best], turned or foreign)


def audit(
    net: VoteNet, folder: Path, names: Sequence[str], progress: Progress, size: int = 800
) -> list[Verdict]:
    """A verdict on each cached photo."""
    net.eval()
    progress.step("labels against pictures", len(names))
    verdicts = []
    for name in names:
        sample = open_cache(folder, name)
        found = detect_with(net, sample, _SURE, size)
        height, width = sample.image.shape[:2]
        extent = np.array([width, height, width, height], dtype=np.float64)
        verdicts.append(judge(name, sample.boxes / extent, found.boxes / extent))
        progress.advance()
    return verdicts
