"""Two looks at one photo become one answer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import Mask
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.detect.tiles import fuse, mirrored

_W, _H = 120, 80


def found_of(objects: list[tuple[int, int, int, int, int, float]]) -> PhotoDetections:
    """Filled rectangles x0, y0, x1, y1, label, score."""
    masks = tuple(
        Mask(np.ones((y1 - y0, x1 - x0), bool), x0, y0, _W, _H, label, score)
        for x0, y0, x1, y1, label, score in objects
    )
    boxes = np.array([o[:4] for o in objects], dtype=float).reshape(-1, 4)
    scores = np.array([o[5] for o in objects], dtype=float)
    return PhotoDetections(
        _W, _H, boxes, scores, np.array([o[4] for o in objects], np.int64), masks
    )


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 99), st.integers(0, 59), st.integers(1, 20), st.integers(1, 20))
def test_mirroring_moves_box_and_mask_together(x: int, y: int, w: int, h: int) -> None:
    found = found_of([(x, y, x + w, y + h, 1, 0.5)])
    other = mirrored(found)
    full = found.masks[0].full()[:, ::-1]
    np.testing.assert_array_equal(other.masks[0].full(), full)
    np.testing.assert_allclose(other.boxes[0], [_W - x - w, y, _W - x, y + h])
    again = mirrored(other)
    np.testing.assert_allclose(again.boxes, found.boxes)
    np.testing.assert_array_equal(again.masks[0].full(), found.masks[0].full())


def test_what_both_see_is_surer_than_what_one_sees() -> None:
    first = found_of([(10, 10, 30, 30, 1, 0.4), (60, 10, 80, 30, 1, 0.6)])
    second = found_of([(12, 10, 32, 30, 1, 0.6)])
    fused = fuse([first, second])
    np.testing.assert_allclose(fused.scores, [0.5, 0.3])
    np.testing.assert_allclose(fused.boxes[0], [11.2, 10, 31.2, 30])
    assert fused.masks[0].box == (12, 10, 20, 20), "the mask of the surer look"
    assert fused.masks[0].score == pytest.approx(0.5)


def test_classes_and_neighbours_stay_apart() -> None:
    first = found_of([(10, 10, 50, 50, 2, 0.5)])
    second = found_of([(10, 10, 50, 50, 1, 0.5), (70, 10, 90, 30, 2, 0.5)])
    assert len(fuse([first, second])) == 3


def test_one_object_of_a_look_meets_one_of_the_other() -> None:
    """Two neighbours of one look are never swallowed by one object of the other."""
    first = found_of([(10, 10, 30, 30, 1, 0.9)])
    second = found_of([(10, 10, 30, 30, 1, 0.8), (12, 10, 32, 30, 1, 0.7)])
    fused = fuse([first, second])
    np.testing.assert_allclose(fused.scores, [0.85, 0.35])


def test_nothing_and_one_look() -> None:
    empty = found_of([])
    assert len(fuse([empty, empty])) == 0
    only = found_of([(1, 1, 5, 5, 1, 0.5)])
    assert fuse([only]) is only
    assert len(fuse([empty, only])) == 1
