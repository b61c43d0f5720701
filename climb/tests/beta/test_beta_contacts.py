"""Contacts of limbs with holds, from points in the frames of a clip."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo.core import Camera, InputError
from walltopo.scans.routes import Route
from walltopo_climb.beta.attempt import attempt_of
from walltopo_climb.beta.contacts import WALL, find_contacts
from walltopo_climb.beta.in_view import Frames, WallHolds, observe

FPS = 10
# A camera four metres before a vertical wall, which lies in the plane y = 0; z is up.
POSE = np.array([[1.0, 0, 0, 0], [0, 0, -1, 1.5], [0, 1, 0, 4]])
FOCAL = 800.0


def ladder(rungs: int = 6, volume: int | None = None) -> WallHolds:
    """Holds of 8 cm across, .4 m above each other, left and right in turn; ids from 1."""
    turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = 0.04 * np.stack([np.cos(turns), 0 * turns, np.sin(turns)], axis=1)
    centres = np.array([[0.2 * (-1) ** k, 0, 0.8 + 0.4 * k] for k in range(rungs)])
    ids = np.arange(1, rungs + 1)
    return WallHolds(ids, centres[:, None] + np.vstack([ring, [[0, 0, 0]]]), ids == volume)


def filmed(paths: np.ndarray, poses: np.ndarray | None = None) -> Frames:
    """Frames of limbs at places (F, 4, 3) m, filmed by cameras (F, 3, 4) or a still one."""
    n = len(paths)
    frames = Frames(
        times=np.arange(n) / FPS,
        points=np.zeros((n, 4, 2)),
        confidence=np.ones((n, 4)),
        hips=np.zeros((n, 2)),
        camera=Camera("PINHOLE", 720, 1280, (FOCAL, FOCAL, 360.0, 640.0)),
        cam_from_world=np.tile(POSE, (n, 1, 1)) if poses is None else poses,
    )
    for frame in range(n):
        frames.points[frame], _ = frames.project(frame, paths[frame])
        frames.hips[frame], _ = frames.project(frame, paths[frame].mean(axis=0))
    return frames


def climbing(holds: WallHolds, *stops: tuple[int, int, int, int]) -> np.ndarray:
    """Limbs that rest on holds for 1.5 s and move to the next ones within .5 s; 0: far off."""
    far = np.array([[-1.5, 0, 1.0], [1.5, 0, 1.0], [-1.5, 0, 0.2], [1.5, 0, 0.2]])
    centres = holds.surface.mean(axis=1)
    places = [
        np.array([centres[hold - 1] if hold else far[limb] for limb, hold in enumerate(stop)])
        for stop in stops
    ]
    path = []
    for here, there in zip(places, [*places[1:], places[-1]], strict=True):
        path += [here] * 15
        path += [here + share * (there - here) for share in np.linspace(0.1, 0.9, 5)]
    return np.array(path)


def found_by(holds: WallHolds, frames: Frames, limb: int) -> list[tuple[int, float]]:
    contacts = find_contacts(frames, holds)
    return [(one.hold, round(one.begin, 1)) for one in contacts if one.limb == limb]


def test_distances_are_those_of_the_wall_and_speeds_relative_to_it() -> None:
    holds = ladder()
    path = np.tile(holds.surface[0].mean(axis=0) + [0.14, 0, 0], (5, 4, 1))
    # The phone moves to the right at a metre a second; the limbs do not move.
    poses = np.tile(POSE, (5, 1, 1))
    poses[:, 0, 3] -= np.arange(5) / FPS
    seen = observe(filmed(path, poses), holds)
    assert seen.distance[:, :, 0] == pytest.approx(np.full((5, 4), 0.10), abs=1e-6)
    assert seen.speed.max() < 1e-6
    assert seen.metres_per_px == pytest.approx(np.full(5, 4 / FOCAL))


def test_each_limb_is_on_its_holds_in_their_order() -> None:
    holds = ladder()
    path = climbing(holds, (0, 0, 0, 0), (3, 4, 1, 2), (5, 4, 1, 2), (5, 6, 1, 2), (5, 6, 3, 2))
    frames = filmed(path)
    expected = {0: [3, 5], 1: [4, 6], 2: [1, 3], 3: [2]}
    for limb, wanted in expected.items():
        found = found_by(holds, frames, limb)
        assert [hold for hold, _ in found if hold != WALL] == wanted
    held = [one for one in find_contacts(frames, holds) if one.hold != WALL]
    assert all(one.confidence > 0.8 for one in held)
    assert abs(found_by(holds, frames, 0)[1][1] - 4.0) <= 0.3


def test_a_few_wrong_or_hidden_frames_break_no_contact() -> None:
    holds = ladder()
    frames = filmed(climbing(holds, (3, 4, 1, 2), (3, 4, 1, 2)))
    before = found_by(holds, frames, 0)
    frames.points[10:12, 0] += 120  # at the elbow
    frames.points[20:27, 0] -= 60
    frames.confidence[20:27, 0] = 0.0
    assert found_by(holds, frames, 0) == before
    assert [hold for hold, _ in before] == [3]


def test_a_hand_that_passes_holds_is_on_none() -> None:
    holds = ladder()
    centres = holds.surface.mean(axis=1)
    path = np.tile([1.5, 0, 1.0], (20, 4, 1))
    path[:, 0] = np.linspace(centres[0], centres[5], 20)  # 1.3 m/s past all six
    assert found_by(holds, filmed(path), 0) == []


def test_a_limb_on_a_hold_upon_a_volume_is_on_the_hold() -> None:
    holds = ladder(2)
    large = holds.surface[:1] + (holds.surface[:1] - holds.surface[0].mean(axis=0)) * 4
    both = WallHolds(
        np.array([9, 1]), np.concatenate([large, holds.surface[:1]]), np.array([True, False])
    )
    path = np.tile(holds.surface[0].mean(axis=0), (20, 4, 1))
    assert [hold for hold, _ in found_by(both, filmed(path), 0)] == [1]


def test_the_frame_rate_changes_no_contact() -> None:
    holds = ladder()
    path = climbing(holds, (0, 0, 0, 0), (3, 4, 1, 2), (5, 4, 1, 2))
    slow = filmed(path)
    dense = np.repeat(path, 3, axis=0).astype(float)
    dense[1:-1] = (dense[:-2] + dense[1:-1] + dense[2:]) / 3
    fast = filmed(dense)
    fast = Frames(**{**vars(fast), "times": np.arange(len(dense)) / (3 * FPS)})
    for limb in range(4):
        held = [
            [hold for hold, _ in found_by(holds, frames, limb) if hold != WALL]
            for frames in (slow, fast)
        ]
        assert held[0] == held[1]


def test_an_attempt_names_its_route_and_its_top() -> None:
    holds = ladder()
    own = Route(id=7, holds=(1, 2, 3, 4, 5, 6), start=(3, 4), top=(6,))
    other = Route(id=8, holds=(11, 12), start=(11,), top=(12,))
    stops = [(3, 4, 1, 2), (5, 4, 1, 2), (5, 6, 1, 2), (6, 6, 3, 4)]
    topped = attempt_of(filmed(climbing(holds, *stops)), holds, [other, own])
    assert (topped.route, topped.foreign, topped.start) == (7, 0.0, 0.0)
    assert topped.top is not None
    assert topped.top == pytest.approx(6.0, abs=0.3)
    assert topped.fall is None
    # With one hand alone it is no top.
    short = attempt_of(filmed(climbing(holds, *stops[:3])), holds, [other, own])
    assert (short.route, short.top) == (7, None)


def test_an_attempt_ends_with_the_fall() -> None:
    holds = ladder()
    own = Route(id=7, holds=(1, 2, 3, 4, 5, 6), start=(3, 4), top=(6,))
    path = climbing(holds, (3, 4, 1, 2), (5, 4, 1, 2))
    drop = [path[-1] - [0, 0, 0.5 * 9.81 * (k / FPS) ** 2] for k in range(6)]
    rest = [drop[-1]] * 15  # on the mat, hands beside the lowest holds
    attempt = attempt_of(filmed(np.array([*path, *drop, *rest])), holds, [own])
    fall = attempt.fall
    assert fall is not None
    assert fall == pytest.approx(len(path) / FPS, abs=0.3)
    assert attempt.top is None
    assert all(contact.begin < fall for contact in attempt.contacts)


def test_frames_that_do_not_fit_are_refused() -> None:
    frames = filmed(climbing(ladder(), (3, 4, 1, 2)))
    with pytest.raises(InputError, match="ascending"):
        Frames(**{**vars(frames), "times": frames.times[::-1]})
    with pytest.raises(InputError, match="points"):
        Frames(**{**vars(frames), "points": frames.points[:, :3]})
    with pytest.raises(InputError, match="surface"):
        WallHolds(np.array([1]), np.zeros((2, 5, 3)), np.array([False]))
