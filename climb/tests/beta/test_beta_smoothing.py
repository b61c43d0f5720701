"""Tracks are smooth, and keep left and right apart."""

from __future__ import annotations

import numpy as np
import pytest
from climb.tests.beta.bodies import SIZE, pose, upright
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_climb.beta.pose import Point, Pose
from walltopo_climb.beta.smoothing import MAX_EXCHANGE_S, facing_wall, sides_kept, smoothed

Floats = NDArray[np.float64]
RATE = 15.0
LEFT = [point for point in Point if point.name.startswith("LEFT") and point > Point.RIGHT_EAR]
ARM, LEG = LEFT[1:6], LEFT[7:]


def climb(number: int) -> Floats:
    """Return a person who moves up slowly."""
    return upright(100.0 + number / 7, 300.0 - number)


def exchanged(points: Floats, left: list[Point]) -> Floats:
    """Return points with some left ones and their right ones exchanged."""
    found = points.copy()
    rows, others = [int(p) for p in left], [int(p) + 1 for p in left]
    found[rows + others] = points[others + rows]
    return found


def timed(tracks: list[Floats]) -> list[tuple[float, Pose | None]]:
    return [(k / RATE, pose(points)) for k, points in enumerate(tracks)]


def points_of(poses: list[Pose | None]) -> Floats:
    return np.array([each.points for each in poses if each is not None])


@pytest.mark.parametrize("limbs", [ARM, LEG, LEFT])
def test_exchanged_limbs_are_exchanged_back(limbs: list[Point]) -> None:
    truth = [climb(k) for k in range(30)]
    seen = [exchanged(p, limbs) if k in (7, 8, 15) else p for k, p in enumerate(truth)]
    found = [each for _, each in sides_kept(timed(seen))]
    assert points_of(found) == pytest.approx(np.array(truth))


@pytest.mark.parametrize("turn", [0.0, 0.9, 2.5, np.pi])
def test_a_climber_faces_the_wall_however_the_body_is_turned(turn: float) -> None:
    points = upright(0.0, 0.0)
    cos, sin = np.cos(turn), np.sin(turn)
    truth = points @ np.array([[cos, sin], [-sin, cos]])
    assert facing_wall(pose(truth)).points == pytest.approx(truth)
    mirrored = facing_wall(pose(exchanged(truth, LEFT)))
    assert mirrored.points == pytest.approx(truth)


def test_a_body_seen_from_the_side_stays_as_it_is() -> None:
    points = upright(0.0, 0.0)
    points[:, 0] *= 0.05
    seen = pose(exchanged(points, LEFT))
    assert facing_wall(seen) is seen


def test_confidence_moves_with_exchanged_limbs() -> None:
    sure = np.linspace(0.5, 1, 33)
    first, second = pose(climb(0)), pose(exchanged(climb(1), LEFT))
    first = Pose(first.points, sure, 1.0, first.region)
    second = Pose(second.points, exchanged(sure[:, None], LEFT)[:, 0], 1.0, second.region)
    _, (_, found) = sides_kept([(0.0, first), (0.1, second)])
    assert found is not None
    assert found.confidence == pytest.approx(sure)


def test_hands_that_meet_stay() -> None:
    tracks = []
    for number in range(20):
        points = climb(number)
        apart = (number - 10) / 2  # crossing by a few pixels
        points[Point.LEFT_WRIST], points[Point.RIGHT_WRIST] = (100 - apart, 280), (100 + apart, 280)
        tracks.append(points)
    found = [each for _, each in sides_kept(timed(tracks))]
    assert points_of(found) == pytest.approx(np.array(tracks))


def test_an_exchange_that_lasts_is_taken_over() -> None:
    tracks = [climb(k) if k < 5 else exchanged(climb(k), LEFT) for k in range(40)]
    found = points_of([each for _, each in sides_kept(timed(tracks))])
    settled = 5 + round(MAX_EXCHANGE_S * RATE)
    assert found[:settled] == pytest.approx(np.array([climb(k) for k in range(settled)]))
    assert found[settled:] == pytest.approx(np.array(tracks[settled:]))


def test_a_long_gap_begins_a_new_track() -> None:
    turned = pose(exchanged(climb(0), LEFT))
    poses = [(0.0, pose(climb(0))), (0.1, None), (0.9, turned)]
    assert [each for _, each in sides_kept(poses)][2].points == pytest.approx(turned.points)  # type: ignore[union-attr]
    moved = [(0.0, pose(climb(0))), (0.1, None), (0.9, pose(climb(60)))]
    last = list(smoothed(moved))[2]
    assert last is not None
    assert last.points == pytest.approx(climb(60))


def test_a_resting_body_trembles_less_than_half_as_much() -> None:
    rng = np.random.default_rng(0)
    tracks = [upright(100.0, 300.0) + rng.normal(0, 0.5, (33, 2)) for _ in range(150)]
    found = points_of(list(smoothed(timed(tracks))))[15:]
    assert (found - upright(100.0, 300.0)).std() < 0.5 / 2


def test_a_quick_hand_is_followed_with_little_delay() -> None:
    """A hand that moves 0.8 m in 0.3 s has arrived a tenth of a second later, within 5 cm."""
    tracks = []
    for number in range(40):
        points = upright(100.0, 300.0)
        share = np.clip((number / RATE - 1.0) / 0.3, 0, 1)
        points[Point.LEFT_WRIST, 1] -= 0.8 / 2.3 * SIZE * share
        tracks.append(points)
    found = points_of(list(smoothed(timed(tracks))))[:, Point.LEFT_WRIST, 1]
    truth = np.array(tracks)[:, Point.LEFT_WRIST, 1]
    arrived = int(np.ceil(1.4 * RATE))
    assert abs(found[arrived] - truth[arrived]) < 0.05 / 2.3 * SIZE
    assert found[-1] == pytest.approx(truth[-1], abs=0.2)


def test_a_point_of_low_confidence_moves_its_track_less() -> None:
    def last(confidence: float) -> float:
        first, second = pose(climb(0)), pose(climb(0) + 10, confidence=confidence)
        found = list(smoothed([(0.0, first), (1 / RATE, second)]))[1]
        assert found is not None
        return float(found.points[0, 0] - climb(0)[0, 0])

    assert 0 < last(0.1) < 0.2 * last(0.9) < 2


def test_frames_without_a_pose_stay_without() -> None:
    poses = [(0.0, pose(climb(0))), (0.1, None), (0.2, pose(climb(0)))]
    found = list(smoothed(poses))
    assert [each is None for each in found] == [False, True, False]
    assert points_of(found) == pytest.approx(np.array([climb(0)] * 2))


def test_poses_out_of_order_are_refused() -> None:
    with pytest.raises(InputError, match=r"a pose at 0.1 s follows one at 0.2 s"):
        list(smoothed([(0.2, pose(climb(0))), (0.1, pose(climb(0)))]))
