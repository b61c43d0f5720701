"""The climber is followed through a clip, not the spotter."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest
from climb.tests.beta.bodies import SIZE, FakeReader, hips, numbered_frames, upright
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_climb.beta.pose import FEET, Image, Pose, shipped_networks
from walltopo_climb.beta.tracking import MAX_PEOPLE, MAX_UNSEEN_S, MAX_WAIT_S, find_poses

Floats = NDArray[np.float64]
GROUND = 300.0  # y of the hips of someone who stands


def climber(number: int, start: int = 0, x: float = 200.0) -> Floats:
    """Return a person who climbs 2 pixels a frame from frame `start` on."""
    return upright(x, GROUND - 2.0 * max(0, number - start))


def squatting(number: int, x: float = 60.0) -> Floats:
    """Return a person who squats and stands up again; the feet stay."""
    points = upright(x, GROUND)
    above = np.setdiff1d(np.arange(33), FEET)
    points[above, 1] += 25 * (1 + np.sin(number / 4)) / 2
    return points


def places(poses: list[Pose | None]) -> list[tuple[float, float] | None]:
    return [None if pose is None else hips(pose.points) for pose in poses]


def test_a_lone_climber_is_found_in_each_frame() -> None:
    reader = FakeReader(lambda k: [climber(k)])
    found = list(find_poses(numbered_frames(100), reader))
    assert places(found) == [hips(climber(k)) for k in range(100)]


def test_once_the_climber_is_known_one_square_is_read_a_frame() -> None:
    reader = FakeReader(lambda k: [squatting(k), climber(k)])
    list(find_poses(numbered_frames(100), reader))
    known = int(0.25 * SIZE / 2) + 1
    assert max(reader.searches) <= known
    assert [reader.readings.count(k) for k in range(known + 1, 100)] == [1] * (99 - known)


def test_a_body_that_leaves_its_square_is_found_in_a_wider_one() -> None:
    def folding(number: int) -> Floats:
        """Return a climber whose hips move by six tenths of the square between two frames."""
        return upright(200.0, GROUND - 2.0 * number - (0.6 * SIZE if number >= 40 else 0.0))

    reader = FakeReader(lambda k: [folding(k)])
    found = list(find_poses(numbered_frames(60), reader))
    assert places(found) == [hips(folding(k)) for k in range(60)]
    assert max(reader.searches) < 40  # nobody was sought in the whole frame


def test_a_spotter_is_not_the_climber() -> None:
    reader = FakeReader(lambda k: [squatting(k), climber(k, start=40)])
    found = list(find_poses(numbered_frames(150), reader))
    assert places(found) == [hips(climber(k, start=40)) for k in range(150)]


def test_a_climber_who_comes_later_is_followed_from_then_on() -> None:
    reader = FakeReader(
        lambda k: [squatting(k), climber(k, start=60)] if k >= 50 else [squatting(k)]
    )
    found = list(find_poses(numbered_frames(120), reader))
    assert places(found[:50]) == [None] * 50
    assert places(found[56:]) == [hips(climber(k, start=60)) for k in range(56, 120)]


def test_a_person_who_walks_away_is_not_the_climber() -> None:
    def walking(number: int) -> Floats:
        """Return a person who shrinks; the head stays at the height of the camera."""
        points = upright(60.0, GROUND)
        return (points - points[0]) * 0.99**number + points[0]

    reader = FakeReader(lambda k: [walking(k), climber(k, start=70)])
    found = list(find_poses(numbered_frames(150), reader))
    assert places(found)[149] == hips(climber(149, start=70))


def test_if_nobody_moves_the_highest_feet_are_the_climbers() -> None:
    people = [upright(60.0, GROUND), upright(200.0, 180.0)]
    found = list(find_poses(numbered_frames(30), FakeReader(lambda _: people)))
    assert places(found) == [(200.0, 180.0)] * 30


def test_a_climber_who_was_hidden_is_found_again() -> None:
    hidden = range(60, 66)

    def people(number: int) -> list[Floats]:
        return [squatting(number)] + ([] if number in hidden else [climber(number)])

    found = list(find_poses(numbered_frames(100), FakeReader(people)))
    expected = [None if k in hidden else hips(climber(k)) for k in range(100)]
    assert places(found) == expected


def test_holds_that_look_like_the_fallen_climber_are_left_soon() -> None:
    reader = FakeReader(lambda k: [] if k >= 60 else [climber(k)], deceptive=True)
    found = list(find_poses(numbered_frames(150), reader))
    lost = 60 + round(MAX_UNSEEN_S * 10)
    assert places(found[:60]) == [hips(climber(k)) for k in range(60)]
    assert places(found[lost:]) == [None] * (150 - lost)


def test_the_climber_is_checked_once_a_second() -> None:
    reader = FakeReader(lambda k: [climber(k)])
    list(find_poses(numbered_frames(100), reader))
    assert 7 <= len(reader.checks) <= 9


def test_a_climber_who_is_hidden_early_keeps_the_track() -> None:
    def people(number: int) -> list[Floats]:
        seen = [] if 20 <= number < 24 else [climber(number, start=30)]
        return [squatting(number), *seen]

    found = list(find_poses(numbered_frames(100), FakeReader(people)))
    assert hips(climber(5, start=30)) == places(found)[5]
    assert places(found)[20:24] == [None] * 4
    assert places(found)[99] == hips(climber(99, start=30))


def test_at_most_a_few_people_are_read() -> None:
    people = [upright(100.0 * k, GROUND) for k in range(9)]
    reader = FakeReader(lambda _: people)
    list(find_poses(numbered_frames(5), reader))
    assert max(reader.readings.count(k) for k in range(1, 5)) <= MAX_PEOPLE


def test_frames_are_read_as_poses_are_wanted() -> None:
    read = 0

    def counted() -> Iterator[tuple[float, Image]]:
        nonlocal read
        for each in numbered_frames(2000):
            read += 1
            yield each

    poses = find_poses(counted(), FakeReader(lambda _: [upright(60.0, GROUND)]))
    next(poses)
    assert read == MAX_WAIT_S * 10 + 1
    list(islice(poses, 300))
    assert read == 301
    empty = find_poses(counted(), FakeReader(lambda _: []))
    read = 0
    assert list(islice(empty, 5)) == [None] * 5
    assert read == 5


def test_a_clip_without_people_has_no_poses() -> None:
    wall = np.full((120, 90, 3), 180, np.uint8)
    frames = [(k / 10, wall) for k in range(3)]
    assert list(find_poses(frames)) == [None] * 3
    assert list(find_poses(frames, shipped_networks())) == [None] * 3


def test_what_is_not_a_clip_is_refused_in_words() -> None:
    frame = np.zeros((4, 4, 3), np.uint8)
    reader = FakeReader(lambda _: [])
    with pytest.raises(InputError, match="the clip has no frames"):
        list(find_poses([], reader))
    with pytest.raises(InputError, match=r"frame 1: its time, 0\.0 s, is not later than 0\.0 s"):
        list(find_poses([(0.0, frame), (0.0, frame)], reader))
    with pytest.raises(InputError, match="frame 0: its time, nan s"):
        list(find_poses([(np.nan, frame)], reader))
    with pytest.raises(InputError, match=r"frame 1: expected \(H, W, 3\)"):
        list(find_poses([(0.0, frame), (1.0, frame[0])], reader))
