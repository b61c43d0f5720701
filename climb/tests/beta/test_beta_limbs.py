"""Limbs of a followed body."""

from __future__ import annotations

import numpy as np
import pytest
from climb.tests.beta.bodies import pose, upright

from walltopo.core import Camera, InputError
from walltopo_climb.beta.in_view import Frames
from walltopo_climb.beta.limbs import frames_of
from walltopo_climb.beta.pose import Point, Pose

CAMERA = Camera("PINHOLE", 100, 160, (800.0, 800.0, 50.0, 80.0))
POSES = np.tile(np.eye(3, 4), (3, 1, 1))


def framed(*poses: Pose | None) -> Frames:
    times = np.arange(len(poses)) / 10
    return frames_of(times, poses, CAMERA, POSES[: len(poses)])


def test_hands_are_the_fingers_and_feet_the_toes() -> None:
    body = upright(200.0, 300.0)
    frames = framed(pose(body), None, pose(body + 10))
    fingers = [Point.RIGHT_INDEX, Point.RIGHT_LITTLE_FINGER, Point.RIGHT_THUMB]
    assert frames.points[0, 1] == pytest.approx(body[fingers].mean(axis=0))
    assert frames.points[0, 2] == pytest.approx(body[Point.LEFT_TOES])
    assert frames.hips[2] == pytest.approx([210.0, 310.0])
    # A frame without a pose says nothing, and keeps the places before.
    assert frames.points[1] == pytest.approx(frames.points[0])
    assert frames.confidence[:, 0] == pytest.approx([0.9, 0.0, 0.9])


def test_the_least_sure_finger_decides() -> None:
    body = pose(upright(200.0, 300.0), score=0.8)
    body.confidence[Point.LEFT_THUMB] = 0.25
    assert framed(body, body).confidence[0, 0] == pytest.approx(0.2)


def test_a_clip_without_a_climber_is_refused() -> None:
    with pytest.raises(InputError, match="no frame shows a climber"):
        framed(None, None)
    with pytest.raises(InputError, match="2 times for 1 poses"):
        frames_of(np.arange(2.0), [None], CAMERA, POSES[:2])
