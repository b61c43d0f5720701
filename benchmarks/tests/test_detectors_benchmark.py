"""The pages show the figures that the benchmark of detectors prints."""

from __future__ import annotations

import numpy as np
from benchmarks.detectors import by_size, coco_rows

from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.evaluate.detector import evaluate_detections

CLASSES = {1: "hold", 2: "volume"}
HOLD, VOLUME = (10.0, 10.0, 20.0, 20.0), (100.0, 100.0, 80.0, 80.0)


def photo(*annotations: Annotation) -> Dataset:
    return Dataset((Photo("a.jpg", 640, 480, annotations),), CLASSES)


def test_the_mean_of_the_classes_stands_first() -> None:
    truth = photo(Annotation(1, HOLD), Annotation(2, VOLUME))
    found = photo(Annotation(1, HOLD, score=0.9))
    rows = list(coco_rows("boxes", evaluate_detections(found, truth).boxes))
    heads = [tuple(row.strip("| ").split(" | ")[:2]) for row in rows]
    # One hold of two objects found: 51 of COCO's 101 recalls are reached with the classes as one.
    assert heads == [
        ("boxes, mean of classes", "0.500"),
        ("boxes, classes as one", "0.505"),
        ("boxes, hold", "1.000"),
        ("boxes, volume", "0.000"),
    ]


def test_objects_are_counted_by_size_at_the_scores_in_use() -> None:
    truth = photo(Annotation(1, HOLD), Annotation(2, VOLUME))
    boxes = np.array([[10.0, 10, 30, 30], [300.0, 300, 320, 320], [100.0, 100, 180, 180]])
    found = PhotoDetections(640, 480, boxes, np.array([0.9, 0.8, 0.05]), np.array([1, 1, 2]))
    assert list(by_size(truth, [found], {1: 0.2, 2: 0.1}))[2:] == [
        "| objects | 0 | 1 | 1 | 0 | 2 |",
        "| recall | 0.000 | 1.000 | 0.000 | 0.000 | 0.500 |",
        "| precision | 0.000 | 0.500 | 0.000 | 0.000 | 0.500 |",
    ]
