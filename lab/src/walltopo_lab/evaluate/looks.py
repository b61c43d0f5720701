"""Run a detector on labelled photos; turn its detections into a data set for evaluation."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from walltopo.images.files import read_rgb
from walltopo.segment.detect.detector import Detector
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo_lab.datasets.model import Annotation, Dataset

LOW_SCORE = 0.03  # average precision ranks all detections down to this score


@dataclass(frozen=True, eq=False)
class Outcome:
    """A detector's results on a set, with the time per photo."""

    found: list[PhotoDetections]
    seconds: list[float]
    cpu: list[float]


def detect_photos(detector: Detector, photos: Sequence[Path]) -> Outcome:
    """Run the detector on each photo; reading the files is not timed."""
    outcome = Outcome([], [], [])
    for path in photos:
        photo = read_rgb(path)
        wall, cpu = time.perf_counter(), time.process_time()
        outcome.found.append(detector.detect(photo))
        outcome.seconds.append(time.perf_counter() - wall)
        outcome.cpu.append(time.process_time() - cpu)
    return outcome


def as_dataset(
    truth: Dataset, found: Sequence[PhotoDetections], classes: dict[int, str], masks: bool
) -> Dataset:
    """Return detections as a data set: with masks, or with only the network's own boxes."""
    photos = []
    for photo, seen in zip(truth.photos, found, strict=True):
        annotations = []
        for k in range(len(seen)):
            x0, y0, x1, y1 = (float(v) for v in seen.boxes[k])
            annotation = Annotation(
                int(seen.labels[k]), (x0, y0, x1 - x0, y1 - y0), score=float(seen.scores[k])
            )
            if masks:
                mask = seen.masks[k]
                x, y, w, h = mask.box
                annotation = replace(annotation, mask=mask, box=(x, y, w, h))
            annotations.append(annotation)
        photos.append(photo.with_annotations(tuple(annotations)))
    return Dataset(tuple(photos), classes)


def plain_boxes(truth: Dataset) -> Dataset:
    """Return the set without its shapes, so that boxes are compared with boxes."""
    return Dataset(
        tuple(
            p.with_annotations(tuple(Annotation(a.label, a.box) for a in p.annotations))
            for p in truth.photos
        ),
        truth.classes,
    )
