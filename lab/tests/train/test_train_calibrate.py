"""Calibration of an exported network, in its metadata."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo_lab.train.calibrate import min_scores, network_offset
from walltopo_lab.train.choose import Truth


def found_of(boxes: np.ndarray, scores: list[float], labels: list[int]) -> PhotoDetections:
    return PhotoDetections(1000, 500, boxes.astype(float), np.array(scores), np.array(labels))


def row(count: int) -> np.ndarray:
    """Boxes of 20 px side by side."""
    x = 10 + 40 * np.arange(count)
    return np.stack([x, x * 0 + 10, x + 20, x * 0 + 30], axis=1).astype(float)


def test_least_scores_are_chosen_by_class() -> None:
    boxes = row(20)
    truth = Truth(boxes[[*range(4), *range(10, 14)]], np.array([1] * 4 + [2] * 4))
    scores = [0.9, 0.8, 0.7, 0.6, *[0.5] * 6, 0.3, 0.25, 0.2, 0.15, *[0.1] * 6]
    found = found_of(boxes, scores, [1] * 10 + [2] * 10)
    assert min_scores([found], [truth], [1, 2]) == [0.6, 0.15]


def test_a_little_precision_is_given_for_recall() -> None:
    boxes = row(24)
    truth = Truth(boxes[:22], np.full(22, 1))
    many = found_of(np.tile(boxes, (30, 1)), [0.5] * 720, [1] * 720)
    assert min_scores([many], [truth], [1])[0] == 0.5
    assert min_scores([found_of(boxes[:0], [], [])], [truth], [1]) == [0.3]


@pytest.mark.parametrize("label_error", [-1.5, 0.0, 2.0])
def test_the_networks_offset_is_reported_from_the_labels(label_error: float) -> None:
    """The network is off by (+3, -2) in its input, the labels by something in the photo."""
    true = row(12)
    scale = 1.0

    class Detector:
        settings = SimpleNamespace(size=1000)

        def detect(self, photo: Any) -> PhotoDetections:
            boxes = true.copy()
            if photo[0, 0, 0]:  # the mark in the corner: mirrored
                boxes[:, [0, 2]] = 1000 - true[:, [2, 0]]
            boxes += np.array([3, -2, 3, -2]) / scale
            return found_of(boxes, [0.9] * 12, [1] * 12)

    photo = np.zeros((500, 1000, 3), np.uint8)
    photo[0, -1] = 255
    truth = Truth(true + [label_error, 0, label_error, 0], np.full(12, 1))
    offset = network_offset(Detector(), [(photo, truth)])  # type: ignore[arg-type]
    np.testing.assert_allclose(offset, [3, -2], atol=0.01)
    assert network_offset(Detector(), []) == [0.0, 0.0]  # type: ignore[arg-type]
