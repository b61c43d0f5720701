"""Figures on held-out photos, by which weights and thresholds are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from numpy.typing import NDArray

from walltopo.segment.detect.found import Found, box_iou
from walltopo.segment.detect.onnx_detector import prepare
from walltopo.segment.detect.votes import decode_votes
from walltopo_lab.evaluate.coco_ap import average_precision
from walltopo_lab.train.cache import Sample, open_cache
from walltopo_lab.train.net import CLASSES, VoteNet

_SIZE = 1280  # px of the longer side, as the detector looks at photos by default


@dataclass(frozen=True, eq=False)
class Truth:
    """Labelled boxes (n, 4) and labels (n,) of one photo."""

    boxes: NDArray[np.float64]
    labels: NDArray[np.int64]


def match_photo(found: Found, truth: Truth, iou: float, by_class: int | None) -> NDArray[np.bool_]:
    """(n,) whether each detection, best first, takes a labelled box that none better took."""
    keep = slice(None) if by_class is None else np.flatnonzero(truth.labels == by_class)
    boxes = truth.boxes[keep]
    hit = np.zeros(len(found), np.bool_)
    if len(boxes) == 0 or len(found) == 0:
        return hit
    overlap = box_iou(found.boxes, boxes)
    free = np.ones(len(boxes), np.bool_)
    for k in np.argsort(-found.scores, kind="stable"):
        best = int(np.where(free, overlap[k], -1.0).argmax())
        if free[best] and overlap[k, best] >= iou:
            hit[k], free[best] = True, False
    return hit


def ap_of(
    found: Sequence[Found], truth: Sequence[Truth], iou: float = 0.5, label: int | None = None
) -> float:
    """AP over photos; `label` None matches without regard to the class."""
    scores, hits, wanted = [], [], 0
    for f, t in zip(found, truth, strict=True):
        if label is not None:
            f = f.pick(np.flatnonzero(f.labels == label))
        wanted += len(t.labels) if label is None else int((t.labels == label).sum())
        scores.append(f.scores)
        hits.append(match_photo(f, t, iou, label))
    if wanted == 0:
        return float("nan")
    return average_precision(np.concatenate(scores), np.concatenate(hits), wanted)


@torch.no_grad()
def detect_with(net: VoteNet, sample: Sample, threshold: float, size: int = _SIZE) -> Found:
    """What the network finds in a cached photo, in the photo's pixels."""
    photo = np.asarray(cv2.cvtColor(np.asarray(sample.image), cv2.COLOR_BGR2RGB), dtype=np.uint8)
    height, width = photo.shape[:2]
    scale = size / max(height, width)
    device = next(net.parameters()).device
    tensor = torch.from_numpy(prepare(photo, scale)).to(device).permute(2, 0, 1)[None].float()
    with torch.autocast(device.type, dtype=torch.bfloat16):
        heat, votes, mask = net(tensor.contiguous(memory_format=torch.channels_last))
    outputs = (torch.sigmoid(heat), votes, torch.sigmoid(mask))
    heat_map, vote_map, mask_map = (t[0].float().cpu().numpy() for t in outputs)
    return decode_votes(heat_map, vote_map, mask_map, threshold, scale, (width, height))


def check_on(net: VoteNet, folder: Path, names: Sequence[str]) -> dict[str, float]:
    """AP at 0.5 IoU of boxes on cached photos; `score` is their mean, the figure to maximise."""
    found, truth = [], []
    for name in names:
        sample = open_cache(folder, name)
        found.append(detect_with(net, sample, 0.03))
        truth.append(Truth(sample.boxes.astype(np.float64), sample.labels))
    figures = {"ap50": ap_of(found, truth)}
    for k, name in enumerate(CLASSES, start=1):
        figures[f"ap50_{name}"] = ap_of(found, truth, label=k)
    figures["score"] = float(np.nanmean(list(figures.values())))
    return figures
