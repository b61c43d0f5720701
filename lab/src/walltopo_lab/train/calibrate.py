"""What an exported network needs to know about itself, measured on held-out photos.

Its constant box error, and per class the least score worth showing, both through the detector as
it is used. Both are written into the file's metadata.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.segment.detect.found import Found, box_iou
from walltopo.segment.detect.onnx_detector import OnnxDetector
from walltopo.segment.detect.settings import DetectSettings
from walltopo_lab.onnx_file import set_metadata
from walltopo_lab.train.cache import Sample, open_cache
from walltopo_lab.train.choose import Truth, ap_of, match_photo, truth_of, without_ignored

LOW_SCORE = 0.03  # score from which detections are looked at
_OFFSET_PHOTOS = 48  # photos that the offset is measured on; it is a median over all objects
_NEAR_BEST = 0.005  # F1 given up for recall: lifting drops what no second photo confirms


def least_scores(
    found: Sequence[Found], truth: Sequence[Truth], classes: Sequence[int]
) -> list[float]:
    """Per class the least score at which F1 (boxes, 0.5 IoU) is nearly the best."""
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


def _errors(found: Found, truth: Truth, scale: float) -> NDArray[np.float64]:
    """(m, 2) error of the middle of each box that meets a label, in input pixels."""
    if not len(found) or not len(truth.labels):
        return np.zeros((0, 2))
    overlap = box_iou(found.boxes, truth.boxes)
    met = np.flatnonzero(overlap.max(axis=1) >= 0.5)
    wrong = found.boxes[met] - truth.boxes[overlap[met].argmax(axis=1)]
    return np.asarray((wrong[:, :2] + wrong[:, 2:]) / 2 * scale)


def network_offset(
    detector: OnnxDetector, photos: Iterable[tuple[NDArray[np.uint8], Truth]]
) -> list[float]:
    """How far right and down the network puts every box, in pixels of its input.

    Labels may be off by a constant, too; in mirrored photos that error changes its side, the
    network's does not, so the mean of both is the network's. Photos upside down are too rare in
    training to tell the two apart in the other direction: there both count.

    Parameters
    ----------
    detector : looks once (`again` 0).
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
            new = _errors(detector.detect(picture), labels, scale)
            errors[k] = np.concatenate([errors[k], new])
    if not all(map(len, errors)):
        return [0.0, 0.0]
    middle = np.mean([np.median(e, axis=0) for e in errors], axis=0)
    return [round(float(v), 2) for v in middle]


def look_at(detector: OnnxDetector, sample: Sample) -> Found:
    """What a detector finds in a cached photo, as it is used on photos."""
    photo = cv2.cvtColor(np.asarray(sample.image), cv2.COLOR_BGR2RGB)
    return detector.detect(np.asarray(photo, dtype=np.uint8))


def _photos(samples: Sequence[Sample]) -> Iterator[tuple[NDArray[np.uint8], Truth]]:
    for sample in samples:
        photo = cv2.cvtColor(np.asarray(sample.image), cv2.COLOR_BGR2RGB)
        yield np.asarray(photo, dtype=np.uint8), truth_of(sample)


def calibrate(
    model: Path,
    photos: Sequence[tuple[Path, str]],
    progress: Progress,
    settings: DetectSettings | None = None,
) -> tuple[dict[str, float], list[Found]]:
    """Measure an exported network on cached photos and write `scores` and `offset` into it.

    Parameters
    ----------
    photos : cache folder and name of each.

    Returns
    -------
    Thresholds, offset, and AP50 of boxes (classes as one) with the detector's default looks;
    and what it found in each photo from a score of `LOW_SCORE` on.
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
    scores = least_scores(found, truth, list(detector.classes))
    set_metadata(model, {"scores": json.dumps(scores)})
    told = {
        f"threshold_{name}": s for name, s in zip(detector.classes.values(), scores, strict=True)
    }
    figures = {"offset_x": offset[0], "offset_y": offset[1], "ap50": ap_of(found, truth)}
    return {**told, **figures}, found
