"""Bodies for tests: poses, a reader without networks, and sessions with fixed outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo_climb.beta.pose import Body, Image, Point, Pose, Region

Floats = NDArray[np.float64]
SIZE = 100.0  # side of a body's square, pixels

_LEFT, _RIGHT = -8.0, 8.0
_PLACES = {
    "SHOULDER": (1.0, -22.0),
    "ELBOW": (2.0, -14.0),
    "WRIST": (2.5, -6.0),
    "HIP": (0.7, 0.0),
    "KNEE": (0.9, 16.0),
    "ANKLE": (0.8, 30.0),
    "HEEL": (0.8, 32.0),
    "TOES": (1.2, 34.0),
}


def upright(x: float, y: float) -> Floats:
    """Return the (33, 2) points of a person, seen from behind, whose hips are at (x, y)."""
    points = np.tile([0.0, -30.0], (33, 1))
    for point in Point:
        side, _, limb = point.name.partition("_")
        place = _PLACES.get(limb, _PLACES["WRIST"] if limb > "SHOULDER" else None)
        if place is not None and side in ("LEFT", "RIGHT"):
            points[point] = (_LEFT if side == "LEFT" else _RIGHT) * place[0], place[1]
    return points + (x, y)


def pose(points: Floats, score: float = 1.0, confidence: float = 0.9) -> Pose:
    """Return a pose whose square is upright, `SIZE` pixels wide, around the hips."""
    x, y = hips(points)
    return Pose(points, np.full(33, confidence), score, Region(x, y, SIZE, 0.0))


def hips(points: Floats) -> tuple[float, float]:
    """Return the (x, y) of the middle between the hips."""
    x, y = points[[Point.LEFT_HIP, Point.RIGHT_HIP]].mean(axis=0)
    return float(x), float(y)


class FakeReader:
    """A reader of poses that knows where the people of each frame are.

    The first pixel of a frame holds its number.

    Parameters
    ----------
    people : from the number of a frame to the (33, 2) points of its people.
    deceptive : whether a square without a person has the pose of an upright one.
    """

    def __init__(self, people: Callable[[int], Sequence[Floats]], deceptive: bool = False) -> None:
        self._people, self._deceptive = people, deceptive
        self.searches: list[int] = []
        self.readings: list[int] = []
        self.checks: list[int] = []

    def find_bodies(self, frame: Image) -> list[Body]:
        number = _number(frame)
        self.searches.append(number)
        return [Body(Region(*hips(points), SIZE, 0.0), 0.9) for points in self._people(number)]

    def shows_body(self, frame: Image, pose: Pose) -> bool:
        self.checks.append(_number(frame))
        away = [np.hypot(*(hips(p) - pose.region.centre)) for p in self._people(_number(frame))]
        return bool(min(away, default=np.inf) < pose.region.size / 4)

    def read_pose(self, frame: Image, region: Region) -> Pose:
        """Return the pose of the person nearest to the square's centre."""
        number = _number(frame)
        self.readings.append(number)
        people = self._people(number)
        away = [float(np.hypot(*(hips(points) - region.centre))) for points in people]
        if min(away, default=np.inf) > region.size / 2:
            return pose(upright(region.x, region.y), score=1.0 if self._deceptive else 0.1)
        return pose(people[int(np.argmin(away))])


def numbered_frames(count: int, rate: float = 10.0) -> Iterator[tuple[float, Image]]:
    """Yield frames that hold their number, `rate` a second."""
    for k in range(count):
        frame = np.zeros((4, 4, 3), np.uint8)
        frame[0, 0, :2] = k % 256, k // 256
        yield k / rate, frame


def _number(frame: Image) -> int:
    return int(frame[0, 0, 0]) + 256 * int(frame[0, 0, 1])


class FixedSession:
    """A network whose outputs are fixed; it keeps its last input."""

    def __init__(self, outputs: Mapping[str, NDArray[np.float32]]) -> None:
        self._outputs = outputs
        self.pictures = np.zeros(0, np.float32)

    def run(self, outputs: Sequence[str], inputs: Mapping[str, Any], /) -> Sequence[Any]:
        self.pictures = inputs["pictures"]
        return [self._outputs[name] for name in outputs]
