"""Metrics on held-out photos, for the choice of weights and thresholds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from walltopo.segment.detect.onnx_detector import prepare
from walltopo.segment.detect.photo_detections import PhotoDetections, box_iou
from walltopo.segment.detect.votes import decode_votes
from walltopo_lab.evaluate.coco_ap import average_precision
from walltopo_lab.train.cache import Sample, ignored_at, open_cache
from walltopo_lab.train.net import CLASSES, VoteNet
from walltopo_lab.train.precision import fast_autocast

_SIZE = 1280  # px of the longer side, the detector's default


@dataclass(frozen=True, eq=False)
class Truth:
    """Labelled boxes (n, 4) and class labels (n,) of one photo."""

    boxes: NDArray[np.float64]
    labels: NDArray[np.int64]


def truth_of(sample: Sample) -> Truth:
    """Return the labels of a cached photo."""
    return Truth(sample.boxes.astype(np.float64), sample.labels)


def match_detections(
    overlap: NDArray[np.float64], scores: NDArray[np.float64], iou: float
) -> NDArray[np.bool_]:
    """Return (n,) whether each detection matches a labelled object that no better one matched.

    Parameters
    ----------
    overlap : (n, m) IoU of detections, best first, and labelled objects.
    """
    hit = np.zeros(len(scores), np.bool_)
    if overlap.size == 0:
        return hit
    free = np.ones(overlap.shape[1], np.bool_)
    for k in np.argsort(-scores, kind="stable"):
        best = int(np.where(free, overlap[k], -1.0).argmax())
        if free[best] and overlap[k, best] >= iou:
            hit[k], free[best] = True, False
    return hit


def match_photo(
    found: PhotoDetections, truth: Truth, iou: float, by_class: int | None
) -> NDArray[np.bool_]:
    """Return (n,) whether each detection matches a labelled box; see `match_detections`."""
    keep = slice(None) if by_class is None else np.flatnonzero(truth.labels == by_class)
    boxes = truth.boxes[keep]
    if len(boxes) == 0 or len(found) == 0:
        return np.zeros(len(found), np.bool_)
    return match_detections(box_iou(found.boxes, boxes), found.scores, iou)


def ap_of(
    found: Sequence[PhotoDetections],
    truth: Sequence[Truth],
    iou: float = 0.5,
    label: int | None = None,
) -> float:
    """Return the AP over photos; `label` None matches regardless of class."""
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
def detect_with(
    net: VoteNet, sample: Sample, threshold: float, size: int = _SIZE
) -> PhotoDetections:
    """Return the network's detections in a cached photo, in the photo's pixels."""
    photo = sample.rgb()
    height, width = photo.shape[:2]
    scale = size / max(height, width)
    device = next(net.parameters()).device
    tensor = torch.from_numpy(prepare(photo, scale)).to(device).permute(2, 0, 1)[None].float()
    with fast_autocast(device):
        heat, votes, mask = net(tensor.contiguous(memory_format=torch.channels_last))
    outputs = (torch.sigmoid(heat), votes, torch.sigmoid(mask))
    heat_map, vote_map, mask_map = (t[0].float().cpu().numpy() for t in outputs)
    return decode_votes(heat_map, vote_map, mask_map, threshold, scale, (width, height))


def without_ignored(found: PhotoDetections, sample: Sample) -> PhotoDetections:
    """Drop detections at positions where the labels are undefined."""
    middle = ((found.boxes[:, :2] + found.boxes[:, 2:]) / 2).astype(int)
    height, width = sample.ids.shape
    x, y = np.clip(middle, 0, [width - 1, height - 1]).T
    here = sample.ids[y, x]
    ignored = np.zeros(len(found), np.bool_)
    for label in range(1, len(CLASSES) + 1):
        ignored |= (found.labels == label) & ignored_at(here, label)
    return found.pick(np.flatnonzero(~ignored))


def mask_iou(found: PhotoDetections, sample: Sample) -> NDArray[np.float64]:
    """Return (n, m) IoU of detected masks with the objects of an exact instance map."""
    count = len(sample.labels) + 1
    ids = np.maximum(sample.ids, 0)
    areas = np.bincount(ids.ravel(), minlength=count)
    rows = [np.zeros((0, count - 1))]
    for mask in found.masks:
        inside = ids[mask.full()]
        both = np.bincount(inside, minlength=count)
        rows.append((both / np.maximum(len(inside) + areas - both, 1))[None, 1:])
    return np.concatenate(rows)


def _mask_ap(found: Sequence[PhotoDetections], samples: Sequence[Sample], label: int) -> float:
    scores, hits, wanted = [], [], 0
    for f, sample in zip(found, samples, strict=True):
        mine = f.pick(np.flatnonzero(f.labels == label))
        overlap = mask_iou(mine, sample)[:, sample.labels == label]
        wanted += overlap.shape[1]
        scores.append(mine.scores)
        hits.append(match_detections(overlap, mine.scores, 0.5))
    if wanted == 0:
        return float("nan")
    return average_precision(np.concatenate(scores), np.concatenate(hits), wanted)


def figures_of(
    found: Sequence[PhotoDetections], samples: Sequence[Sample], exact: Sequence[bool] = ()
) -> dict[str, float]:
    """Return AP at 0.5 IoU on cached photos; `score`, the objective, is the mean box AP.

    Parameters
    ----------
    exact : per photo whether its outlines were drawn; mask AP is measured on those photos.
    """
    found = [without_ignored(f, s) for f, s in zip(found, samples, strict=True)]
    truth = [truth_of(s) for s in samples]
    drawn = [k for k, is_exact in enumerate(exact) if is_exact]
    boxes, masks = {}, {}
    for label, name in enumerate(CLASSES, start=1):
        boxes[f"ap50_{name}"] = ap_of(found, truth, label=label)
        if drawn:
            mine = [found[k] for k in drawn], [samples[k] for k in drawn]
            masks[f"mask50_{name}"] = _mask_ap(*mine, label)
    figures = {"ap50": ap_of(found, truth), **boxes, **masks}
    figures["score"] = _mean(boxes.values())
    if drawn:
        figures["mask50"] = _mean(masks.values())
    return figures


def _mean(values: Iterable[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else 0.0


def check_on(
    net: VoteNet, photos: Sequence[tuple[Path, str]], exact: Sequence[bool] = ()
) -> dict[str, float]:
    """Return the metrics of a network with one pass per cached photo (folder, name).

    See `figures_of` for the metrics.
    """
    samples = [open_cache(folder, name) for folder, name in photos]
    return figures_of([detect_with(net, sample, 0.03) for sample in samples], samples, exact)
