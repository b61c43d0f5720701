"""From the network's outputs to masks: what is drawn must come back."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.segment.detect.votes import decode_votes, vote_boxes

_H, _W = 96, 128  # px of the input


def outputs(
    boxes: list[tuple[int, int, int, int]], labels: list[int], scores: list[float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what a perfect network answers for filled rectangles."""
    heat = np.zeros((2, _H // 4, _W // 4), np.float32)
    votes = np.ones((8, _H // 4, _W // 4), np.float32)
    mask = np.zeros((2, _H // 2, _W // 2), np.float32)
    x = (np.arange(_W // 4) * 4 + 2)[None, :]
    y = (np.arange(_H // 4) * 4 + 2)[:, None]
    for (x0, y0, x1, y1), label, score in zip(boxes, labels, scores, strict=True):
        c = label - 1
        inside = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
        distances = np.stack(np.broadcast_arrays(x - x0, y - y0, x1 - x, y1 - y))
        votes[4 * c : 4 * c + 4][:, inside] = distances[:, inside]
        mask[c, y0 // 2 : y1 // 2, x0 // 2 : x1 // 2] = 1.0
        heat[c, (y0 + y1) // 8, (x0 + x1) // 8] = score
    return heat, votes, mask


def test_touching_objects_come_apart_at_the_votes() -> None:
    boxes = [(16, 16, 48, 64), (48, 16, 80, 64)]
    found = decode_votes(*outputs(boxes, [1, 1], [0.9, 0.8]), 0.3, 1.0, (_W, _H))
    assert len(found) == 2
    np.testing.assert_allclose(found.boxes, boxes)
    for mask, (x0, y0, x1, y1) in zip(found.masks, boxes, strict=True):
        true = np.zeros((_H, _W), bool)
        true[y0:y1, x0:x1] = True
        both = (mask.full() & true).sum() / (mask.full() | true).sum()
        assert both > 0.9


def test_a_hold_lies_on_a_volume() -> None:
    boxes = [(8, 8, 104, 88), (40, 32, 64, 56)]
    found = decode_votes(*outputs(boxes, [2, 1], [0.8, 0.9]), 0.3, 1.0, (_W, _H))
    assert found.labels.tolist() == [1, 2]
    assert found.masks[0].area == pytest.approx(24 * 24, rel=0.1)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 15),
    st.integers(0, 10),
    st.integers(4, 10),
    st.integers(4, 10),
    st.sampled_from([0.5, 1.0, 1.6]),
)
def test_boxes_and_masks_are_in_photo_pixels(i: int, j: int, w: int, h: int, scale: float) -> None:
    box = (4 * i, 4 * j, 4 * (i + w), 4 * (j + h))
    size = (round(_W / scale), round(_H / scale))
    found = decode_votes(*outputs([box], [1], [0.7]), 0.3, scale, size)
    assert len(found) == 1
    np.testing.assert_allclose(found.boxes[0] * scale, box, atol=1e-6)
    mask = found.masks[0]
    assert (mask.width, mask.height) == size
    x, y, wide, tall = mask.box
    extent = np.array([x, y, x + wide, y + tall]) * scale
    np.testing.assert_allclose(extent, box, atol=2 + scale)


@pytest.mark.parametrize("sureness", [0.15, 0.3, 0.5, 0.9])
def test_a_faint_mask_fills_its_box(sureness: float) -> None:
    boxes = [(16, 16, 64, 64)]
    heat, votes, mask = outputs(boxes, [1], [0.9])
    # The middle is as sure as ever, the rest as a network is of what it has hardly seen.
    faint = np.where(mask > 0, sureness, 0.0).astype(np.float32)
    faint[0, 16:24, 16:24] = 0.95
    found = decode_votes(heat, votes, faint, 0.1, 1.0, (_W, _H))
    assert found.masks[0].area == pytest.approx(48 * 48, rel=0.1)


def test_what_is_sure_around_an_object_is_cut_off_at_a_higher_level() -> None:
    heat, votes, mask = outputs([(32, 32, 64, 64)], [1], [0.9])
    sure = cv2.GaussianBlur(mask[0], (0, 0), 3)
    drawn = decode_votes(heat, votes, np.stack([sure, mask[1]]), 0.1, 1.0, (_W, _H)).masks[0]
    assert drawn.area == pytest.approx(32 * 32, rel=0.25)


def test_cells_that_vote_for_nothing_belong_to_what_they_touch() -> None:
    heat, votes, mask = outputs([(16, 16, 48, 48), (48, 16, 80, 48)], [1, 1], [0.9, 0.8])
    votes[:4, :, 4] = 0.1  # the first one's left column has votes for nothing
    found = decode_votes(heat, votes, mask, 0.3, 1.0, (_W, _H))
    first, second = found.masks
    assert first.area > 0.9 * 32 * 32
    assert not (first.full() & second.full()).any()


def test_nothing_above_the_threshold_is_nothing() -> None:
    found = decode_votes(*outputs([(16, 16, 48, 64)], [1], [0.2]), 0.3, 1.0, (_W, _H))
    assert len(found) == 0
    assert found.masks == ()


def test_an_object_without_pixels_is_dropped() -> None:
    heat, votes, mask = outputs([(16, 16, 48, 64)], [1], [0.9])
    assert len(decode_votes(heat, votes, mask * 0, 0.3, 1.0, (_W, _H))) == 0


def test_votes_are_distances_from_the_middle_of_a_cell() -> None:
    boxes = vote_boxes(np.full((4, 2, 3), 5.0, np.float32))
    assert boxes.shape == (1, 2, 3, 4)
    np.testing.assert_allclose(boxes[0, 1, 2], [5, 1, 15, 11])
