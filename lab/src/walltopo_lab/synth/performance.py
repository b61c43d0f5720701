"""A body that climbs a route: its limbs over time, with the exact contacts.

The moves are those of the movement model; between two of them the limb travels in an arc off the
wall. Times follow what videos of climbers show: a hand takes about .7 s, a foot .5 s, and the body
waits .2 to 1.2 s before the next move.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from walltopo.core import Camera
from walltopo_climb.beta.in_view import LIMBS, Frames
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.sequence import LIMBS as NAMES
from walltopo_climb.movement.sequence import Climb, Sequence
from walltopo_lab.synth.path import look_at

Floats = npt.NDArray[np.float64]

_AIR: Final = -1
_GRAVITY: Final = 9.81
_FEET: Final = (2, 3)
_HANGING: Final = 0.97  # length of a hanging leg, in lengths of the straight one


@dataclass(frozen=True)
class TrueContact:
    """A limb on a hold, by its index in the climb; s."""

    limb: int
    hold: int
    begin: float
    end: float


@dataclass(frozen=True)
class Performance:
    """The climb of one body.

    Parameters
    ----------
    times : (F,) s. limbs : (F, 4, 3) m, fingers and toes. hips : (F, 3) m.
    contacts : in order of their begin. topped : s, or None.
    """

    times: Floats
    limbs: Floats
    hips: Floats
    contacts: tuple[TrueContact, ...]
    topped: float | None


@dataclass
class _Body:
    """Positions while they are written: a waypoint of limbs and hips at a time."""

    limbs: Floats
    hip: Floats


class _Timeline:
    """Frames and contacts of a climb as it goes on."""

    def __init__(self, fps: float) -> None:
        self.step = 1.0 / fps
        self.limbs: list[Floats] = []
        self.hips: list[Floats] = []
        self.open: dict[int, tuple[int, float]] = {}
        self.contacts: list[TrueContact] = []

    @property
    def now(self) -> float:
        """Return the time of the next frame, s."""
        return len(self.limbs) * self.step

    def add(self, limbs: Floats, hip: Floats) -> None:
        self.limbs.append(limbs.copy())
        self.hips.append(hip.copy())

    def grip(self, limb: int, hold: int) -> None:
        if hold != _AIR:
            self.open[limb] = hold, self.now

    def release(self, limb: int) -> None:
        if limb in self.open:
            hold, begin = self.open.pop(limb)
            self.contacts.append(TrueContact(limb, hold, begin, self.now))


def perform(
    climb: Climb, sequence: Sequence, rng: np.random.Generator, fps: float = 10.0
) -> Performance:
    """Return the climb of a sequence: from the ground to the top, or to the fall after its end."""
    line = _Timeline(fps)
    out = climb.grips.wall.mean(axis=0)
    side = right_of(out)
    spots = climb.grips.position + 0.01 * out  # the fingers lie on the hold, not in the wall
    body = _stand_before_start(spots[list(climb.start)].mean(axis=0), sequence.body, out, side)
    _wait(line, body, rng.uniform(0.6, 1.5))
    first = sequence.moves[0]
    for limb, hold in enumerate(first.limbs):
        _move_limb(
            line, body, limb, hold, spots, np.array(first.hip), (out, side, sequence.body), rng
        )
    for move in sequence.moves[1:]:
        _wait(line, body, rng.uniform(0.2, 1.2))
        limb = NAMES.index(move.limb) if move.limb is not None else 0
        at = move.limbs[limb]
        _move_limb(line, body, limb, at, spots, np.array(move.hip), (out, side, sequence.body), rng)
    topped = None
    if sequence.reached:
        topped = line.now
        _wait(line, body, rng.uniform(0.8, 2.0))
    else:
        _wait(line, body, rng.uniform(0.4, 1.0))
    _fall_off(line, body)
    for limb in list(line.open):
        line.release(limb)
    contacts = tuple(sorted(line.contacts, key=lambda one: (one.begin, one.limb)))
    times = np.arange(len(line.limbs), dtype=np.float64) * line.step
    hips, limbs = np.array(line.hips), np.array(line.limbs)
    return Performance(times, limbs, hips, contacts, topped)


def right_of(out: Floats) -> Floats:
    """Return the unit vector to the right of a climber who faces a wall, (3,).

    Parameters
    ----------
    out : (3,) out of the wall.
    """
    side = np.cross(-out, [0.0, 0.0, 1.0])
    return side / max(float(np.linalg.norm(side)), 1e-9)


def _stand_before_start(start: Floats, person: Body, out: Floats, side: Floats) -> _Body:
    """Return the body on the ground in front of the start."""
    level = out * [1, 1, 0]
    base = start * [1, 1, 0] + 0.5 * level / max(float(np.linalg.norm(level)), 1e-9)
    hip = base + [0.0, 0.0, person.leg]
    hands = [hip + sign * 0.25 * side + [0.0, 0.0, -0.1] for sign in (-1, 1)]
    feet = [base + sign * 0.12 * side for sign in (-1, 1)]
    return _Body(np.array([*hands, *feet]), hip)


def _wait(line: _Timeline, body: _Body, seconds: float) -> None:
    for _ in range(max(1, round(seconds / line.step))):
        line.add(body.limbs, body.hip)


def _move_limb(
    line: _Timeline,
    body: _Body,
    limb: int,
    hold: int,
    spots: Floats,
    hip: Floats,
    frame: tuple[Floats, Floats, Body],
    rng: np.random.Generator,
) -> None:
    """Move one limb to a hold in an arc, and the hips along."""
    out = frame[0]
    line.release(limb)
    target = spots[hold] if hold != _AIR else _free_limb(hip, limb, frame)
    duration = rng.uniform(0.5, 0.9) if limb < LIMBS // 2 else rng.uniform(0.35, 0.7)
    begin, hip_begin = body.limbs[limb].copy(), body.hip.copy()
    arc = rng.uniform(0.08, 0.2)
    frames = max(2, round(duration / line.step))
    for number in range(1, frames + 1):
        share = 0.5 - 0.5 * np.cos(np.pi * number / frames)
        body.limbs[limb] = begin + share * (target - begin) + arc * np.sin(np.pi * share) * out
        body.hip = hip_begin + share * (hip - hip_begin)
        for foot in _FEET:
            if foot != limb and foot not in line.open:
                body.limbs[foot] = _free_limb(body.hip, foot, frame)
        line.add(body.limbs, body.hip)
    line.grip(limb, hold)


def _free_limb(hip: Floats, limb: int, frame: tuple[Floats, Floats, Body]) -> Floats:
    """Return where a limb without a hold is: below the hips, on the ground at the lowest."""
    out, side, person = frame
    place = hip + (1 if limb % 2 else -1) * 0.12 * side + 0.05 * out
    return np.array([place[0], place[1], max(place[2] - _HANGING * person.leg, 0.0)])


def _fall_off(line: _Timeline, body: _Body) -> None:
    """Let go of everything and fall onto the mat."""
    for limb in range(LIMBS):
        line.release(limb)
    begin, lowest = line.now, float(body.limbs[:, 2].min())
    while True:
        drop = 0.5 * _GRAVITY * (line.now - begin + line.step) ** 2
        down = [0.0, 0.0, min(drop, max(lowest, 0.0))]
        line.add(body.limbs - down, body.hip - down)
        if drop >= lowest:
            break
    body.limbs, body.hip = line.limbs[-1].copy(), line.hips[-1].copy()
    _wait(line, body, 0.8)


@dataclass(frozen=True)
class PoseErrors:
    """The errors of a pose network, in pixels and shares of frames.

    Parameters
    ----------
    jitter : standard deviation of each point. snapped : share of frames in which a hand lies at
        the elbow or a foot at the other one, for two to four frames. hidden : share of frames in
        which a limb is not seen: low confidence, three times the jitter.
    """

    jitter: float = 5.0
    snapped: float = 0.04
    hidden: float = 0.08


def film(
    performance: Performance,
    eye: Floats,
    rng: np.random.Generator,
    errors: PoseErrors,
    *,
    handheld: bool = False,
    size: tuple[int, int] = (720, 1280),
) -> Frames:
    """Return what a pose network finds in a clip of a performance.

    Parameters
    ----------
    eye : (3,) m, the phone; it looks at the middle of the climb. size : width, height px.
    """
    n = len(performance.times)
    middle = performance.hips.mean(axis=0)
    shake = np.cumsum(rng.normal(0, 0.004 if handheld else 0.0, (n, 3)), axis=0)
    poses = np.array([look_at(eye + 2 * move, middle + move, 0.0) for move in shake])
    focal = 1.1 * size[0]
    frames = Frames(
        times=performance.times,
        points=np.zeros((n, LIMBS, 2)),
        confidence=np.full((n, LIMBS), 0.9),
        hips=np.zeros((n, 2)),
        camera=Camera("PINHOLE", *size, (focal, focal, size[0] / 2, size[1] / 2)),
        cam_from_world=poses,
    )
    for frame in range(n):
        frames.points[frame], _ = frames.project(frame, performance.limbs[frame])
        frames.hips[frame], _ = frames.project(frame, performance.hips[frame])
    _add_pose_errors(frames, rng, errors)
    return frames


def _add_pose_errors(frames: Frames, rng: np.random.Generator, errors: PoseErrors) -> None:
    """Add the errors of a pose network to the points, in place."""
    n = len(frames.times)
    exact = frames.points.copy()
    frames.points[:] += rng.normal(0, errors.jitter, frames.points.shape)
    frames.hips[:] += rng.normal(0, errors.jitter, frames.hips.shape)
    for limb in range(LIMBS):
        for begin in np.flatnonzero(rng.random(n) < errors.snapped / 3):
            part = slice(int(begin), int(begin) + int(rng.integers(2, 5)))
            other = exact[part, limb ^ 1] if limb >= LIMBS // 2 else frames.hips[part]
            frames.points[part, limb] = 0.5 * (exact[part, limb] + other)
        for begin in np.flatnonzero(rng.random(n) < errors.hidden / 8):
            part = slice(int(begin), int(begin) + int(rng.integers(3, 14)))
            frames.confidence[part, limb] = 0.2
            wrong = rng.normal(0, 3 * errors.jitter, exact[part, limb].shape)
            frames.points[part, limb] = exact[part, limb] + wrong
