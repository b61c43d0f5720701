"""Photos that a phone took sideways are found and turned."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.feature_sets import Features
from walltopo.reconstruct.sparse.learned_features import XFeat
from walltopo.reconstruct.sparse.quarter_turns import (
    QUARTERS,
    quarter_turns,
    turned_back,
    turned_picture,
)


def blobs(size: tuple[int, int] = (480, 320)) -> NDArray[np.uint8]:
    rng = np.random.default_rng(5)
    picture = np.full((size[1], size[0], 3), 170, np.uint8)
    for _ in range(160):
        at = int(rng.integers(size[0])), int(rng.integers(size[1]))
        axes = int(rng.integers(4, 22)), int(rng.integers(3, 9))
        colour = [int(v) for v in rng.integers(0, 255, 3)]
        cv2.ellipse(picture, at, axes, float(rng.uniform(0, 180)), 0, 360, colour, -1)
    return picture


@pytest.mark.parametrize("turn", range(QUARTERS))
def test_positions_of_a_turned_photo_are_turned_back(turn: int) -> None:
    picture = np.zeros((20, 30, 3), np.uint8)
    picture[4, 25] = 255
    turned = turned_picture(picture, turn)
    y, x, _ = np.argwhere(turned)[0]
    xy = np.array([[x + 0.5, y + 0.5]], np.float32)
    size = turned.shape[1], turned.shape[0]
    found = Features(xy, np.zeros((1, 64), np.float32), size)
    assert turned_back(found, turn).tolist() == [[25.5, 4.5]]


def test_sideways_photos_are_turned_and_others_stay() -> None:
    network, picture = XFeat(), blobs()
    taken = [picture, picture[:, 40:], turned_picture(picture, 1), picture[:300], picture[20:]]
    versions = [
        [network.find(turned_picture(photo, k), 300) for k in range(QUARTERS)] for photo in taken
    ]
    assert quarter_turns(versions) == [0, 0, 3, 0, 0]


def test_photos_without_features_stay_as_they_are() -> None:
    nothing = Features(np.zeros((0, 2), np.float32), np.zeros((0, 64), np.float32), (10, 10))
    assert quarter_turns([[nothing] * QUARTERS] * 3) == [0, 0, 0]
