"""Calibration of an exported network on held-out photos.

It measures the constant box error, and per class the minimum score, both through the detector as
used in the product. Both are written into the file's metadata.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.segment.detect.onnx_detector import OnnxDetector
from walltopo.segment.detect.photo_detections import PhotoDetections, box_iou
from walltopo.segment.settings import DetectSettings
from walltopo_lab.onnx_file import set_metadata
from walltopo_lab.train.cache import Sample, open_cache
from walltopo_lab.train.choose import Truth, ap_of, match_photo, truth_of, without_ignored

LOW_SCORE = 0.03  # minimum score of the evaluated detections
_OFFSET_PHOTOS = 48  # number of photos for the offset, which is a median over all objects
_NEAR_BEST = 0.005  # F1 traded for recall: the lift drops detections without a second photo


def min_scores(
    found: Sequence[PhotoDetections], truth: Sequence[Truth], classes: Sequence[int]
) -> list[float]:
    """Return per class the lowest score at which F1 (boxes, 0.5 IoU) is nearly the best."""
    chosen = []
    for label in classes:
        mine = [f.pick(np.flatnonzero(f.labels == label)) for f in found]
        hits = [match_photo(f, t, 0.5, label) for f, t in zip(mine, truth, strict=True)]
        wanted = sum(int((t.labels == label).sum()) for t in truth)
        scores = np.concatenate([f.scores for f in mine])
        if not wanted or not len(scores):
            chosen.append(0.3)
            continue
        order = np.argsort(-scores, kind="stable")
        good = np.cumsum(np.concatenate(hits)[order])
        f1 = 2 * good / (np.arange(1, len(good) + 1) + wanted)
        last = int(np.flatnonzero(f1 >= f1.max() - _NEAR_BEST)[-1])
        chosen.append(round(float(np.clip(scores[order][last], 0.05, 0.9)), 3))
    return chosen


def _centre_errors(found: PhotoDetections, truth: Truth, scale: float) -> NDArray[np.float64]:
    """Return (m, 2) centre errors of the boxes that match a label, in input pixels."""
    if not len(found) or not len(truth.labels):
        return np.zeros((0, 2))
    overlap = box_iou(found.boxes, truth.boxes)
    met = np.flatnonzero(overlap.max(axis=1) >= 0.5)
    wrong = found.boxes[met] - truth.boxes[overlap[met].argmax(axis=1)]
    return np.asarray((wrong[:, :2] + wrong[:, 2:]) / 2 * scale)


def network_offset(
    detector: OnnxDetector, photos: Iterable[tuple[NDArray[np.uint8], Truth]]
) -> list[float]:
    """Return the network's constant box offset to the right and down, in input pixels.

    Labels may have a constant offset, too. In mirrored photos the label offset changes its sign,
    the network's does not, so their mean is the network's. Upside-down photos are too rare in
    training to separate the two vertically: the vertical offset contains both.

    Parameters
    ----------
    detector : detector with a single pass (`again` 0).
    photos : RGB photos with their labels.
    """
    errors = [np.zeros((0, 2)), np.zeros((0, 2))]
    for photo, truth in photos:
        width = photo.shape[1]
        scale = detector.settings.size / max(photo.shape[:2])
        other = truth.boxes[:, [2, 1, 0, 3]].copy()
        other[:, [0, 2]] = width - other[:, [0, 2]]
        turned = np.ascontiguousarray(photo[:, ::-1])
        sides = ((photo, truth), (turned, Truth(other, truth.labels)))
        for k, (picture, labels) in enumerate(sides):
            new = _centre_errors(detector.detect(picture), labels, scale)
            errors[k] = np.concatenate([errors[k], new])
    if not all(map(len, errors)):
        return [0.0, 0.0]
    middle = np.mean([np.median(e, axis=0) for e in errors], axis=0)
    return [round(float(v), 2) for v in middle]


def look_at(detector: OnnxDetector, sample: Sample) -> PhotoDetections:
    """Return the detections in a cached photo, with the detector as used in the product."""
    return detector.detect(sample.rgb())


def _photos(samples: Sequence[Sample]) -> Iterator[tuple[NDArray[np.uint8], Truth]]:
    for sample in samples:
        yield sample.rgb(), truth_of(sample)


def calibrate(
    model: Path,
    photos: Sequence[tuple[Path, str]],
    progress: Progress,
    settings: DetectSettings | None = None,
) -> tuple[dict[str, float], list[PhotoDetections]]:
    """Measure an exported network on cached photos; write `scores` and `offset` into its file.

    Parameters
    ----------
    photos : cache folder and name of each.

    Returns
    -------
    Thresholds, offset, and AP50 of boxes (classes as one) with the detector's default looks;
    and the detections in each photo with a score of at least `LOW_SCORE`.
    """
    settings = settings or DetectSettings()
    samples = [open_cache(folder, name) for folder, name in photos]
    progress.step("calibration", 1 + len(samples))
    offset = [0.0, 0.0]
    if OnnxDetector(model, settings).model.head == "votes":
        set_metadata(model, {"offset": json.dumps(offset)})
        once = OnnxDetector(model, replace(settings, score=0.2, again=0.0))
        offset = network_offset(once, _photos(samples[:: -(-len(samples) // _OFFSET_PHOTOS)]))
        set_metadata(model, {"offset": json.dumps(offset)})
    progress.advance()
    detector = OnnxDetector(model, replace(settings, score=LOW_SCORE))
    found = []
    for sample in samples:
        found.append(without_ignored(look_at(detector, sample), sample))
        progress.advance()
    truth = [truth_of(sample) for sample in samples]
    scores = min_scores(found, truth, list(detector.classes))
    set_metadata(model, {"scores": json.dumps(scores)})
    metadata = {
        f"threshold_{name}": s for name, s in zip(detector.classes.values(), scores, strict=True)
    }
    figures = {"offset_x": offset[0], "offset_y": offset[1], "ap50": ap_of(found, truth)}
    return {**metadata, **figures}, found
