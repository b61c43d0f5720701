"""Boxes, suppression, and the record of what was found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from walltopo.core import InputError
from walltopo.segment.detect.photo_detections import PhotoDetections, box_iou, suppress_overlaps

_corners = arrays(np.float64, (6, 4), elements=st.floats(0, 100))


def _boxes(raw: np.ndarray) -> np.ndarray:
    low, size = raw[:, :2], raw[:, 2:] + 1.0
    return np.concatenate([low, low + size], axis=1)


@given(_corners)
def test_iou_is_symmetric_and_one_with_itself(raw: np.ndarray) -> None:
    boxes = _boxes(raw)
    overlap = box_iou(boxes, boxes)
    np.testing.assert_allclose(overlap, overlap.T)
    np.testing.assert_allclose(np.diag(overlap), 1.0)
    assert overlap.min() >= 0.0
    assert overlap.max() <= 1.0 + 1e-12


def test_iou_of_a_half_covered_box() -> None:
    a = np.array([[0.0, 0.0, 10.0, 10.0]])
    b = np.array([[5.0, 0.0, 15.0, 10.0]])
    assert box_iou(a, b)[0, 0] == pytest.approx(1 / 3)


@given(_corners, arrays(np.float64, 6, elements=st.floats(0.01, 1)))
def test_what_stays_does_not_clash_and_what_goes_does(raw: np.ndarray, scores: np.ndarray) -> None:
    boxes, labels = _boxes(raw), np.array([1, 1, 1, 2, 2, 2])
    kept = suppress_overlaps(boxes, scores, labels, same_class_iou=0.5, other_class_iou=0.8)
    overlap = box_iou(boxes, boxes)
    limit = np.where(labels[:, None] == labels[None, :], 0.5, 0.8)
    clash = overlap > limit
    assert not any(clash[i, j] for i in kept for j in kept if i != j)
    for gone in set(range(6)) - set(kept.tolist()):
        assert any(clash[gone, k] and scores[k] >= scores[gone] for k in kept)
    assert (np.diff(scores[kept]) <= 0).all()


def test_a_hold_on_its_volume_stays() -> None:
    boxes = np.array([[0.0, 0, 100, 100], [20.0, 20, 90, 95]])
    assert len(suppress_overlaps(boxes, np.array([0.9, 0.8]), np.array([2, 1]))) == 2


def test_unequal_lengths_are_refused() -> None:
    with pytest.raises(InputError, match="expected 2 boxes"):
        PhotoDetections(10, 10, np.zeros((1, 4)), np.ones(2), np.ones(2, dtype=np.int64))
