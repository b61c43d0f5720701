"""Smooth a climber's poses over time, and keep left and right apart.

Seen from behind, a body looks much like its mirror image: the network at times takes the left arm,
the left leg or the whole left side for the right one, in some frames or in all. But a climber faces
the wall, so that the left shoulder is on the left in the picture.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_climb.beta.pose import POINTS, Floats, Point, Pose

MAX_GAP_S = 0.5  # without a pose, after which a track begins anew
# Parameters of the filter (Casiez et al. 2012) for positions in sides of the body's square (about
# 2.3 m). A resting hand is averaged over about a quarter of a second; one that moves at 1 m/s over
# 1/35 s.
MIN_CUTOFF_HZ, CUTOFF_PER_SPEED, SPEED_CUTOFF_HZ = 0.6, 10.0, 1.0
# A new position of at least the second confidence has full weight, one of the first or less 1/10.
_MIN_CONFIDENCE, _FULL_CONFIDENCE = 0.05, 0.5
# Breadth of shoulders and hips together, in sides of the square, from which a body faces the
# camera; less is a view from the side.
_FACING = 0.03
_CLEARLY = 0.5  # ratio of distances below which an exchange is clearly closer
_MIN_APART = 0.03  # mean distance, in sides of the square, below which nothing is exchanged
# An exchange that lasts longer is the network's settled opinion, and becomes the track.
MAX_EXCHANGE_S = 1.0
# Points that are exchanged together: pairs of left and right.
_ARMS = tuple(range(Point.LEFT_ELBOW, Point.LEFT_HIP))
_LEGS = tuple(range(Point.LEFT_KNEE, POINTS))
_ALL = tuple(range(Point.LEFT_SHOULDER, POINTS))
GROUPS = (_ALL, _ARMS, _LEGS)


def smoothed(poses: Iterable[tuple[float, Pose | None]]) -> Iterator[Pose | None]:
    """Yield poses that face the wall, with left and right kept, each point smoothed by a one-euro
    filter.

    A point of low confidence moves its track less. After `MAX_GAP_S` without a pose a track begins
    anew.

    Parameters
    ----------
    poses : time in seconds and pose of each frame, in order.
    """
    last: _State | None = None
    turned = ((time, None if pose is None else facing_wall(pose)) for time, pose in poses)
    for time, pose in sides_kept(turned):
        if pose is None:
            yield None
            continue
        if last is None or time - last.time > MAX_GAP_S:
            last = _State(time, pose.points, np.zeros_like(pose.points))
        else:
            last = last.moved(time, pose)
        yield replace(pose, points=last.points)


def facing_wall(pose: Pose) -> Pose:
    """Return the pose with left and right exchanged if it faces the camera.

    Somebody who really does, on the ground or while shaking out an arm, is exchanged too.
    """
    left = pose.points[[Point.LEFT_SHOULDER, Point.LEFT_HIP]]
    right = pose.points[[Point.RIGHT_SHOULDER, Point.RIGHT_HIP]]
    up, across = _spine_direction(left, right), (right - left).sum(axis=0)
    breadth = float(up[0] * across[1] - up[1] * across[0])  # < 0: the left is on the right
    if breadth >= -_FACING * pose.region.size:
        return pose
    order = np.arange(POINTS)
    order[list(_ALL)] = [_opposite_point(point) for point in _ALL]
    return replace(pose, points=pose.points[order], confidence=pose.confidence[order])


def _spine_direction(left: Floats, right: Floats) -> Floats:
    """Return the (2,) unit direction from hips to shoulders, given both of each side."""
    shoulders, hips = (left + right) / 2
    way = shoulders - hips
    return np.asarray(way / max(float(np.linalg.norm(way)), 1e-9))


def sides_kept(
    poses: Iterable[tuple[float, Pose | None]],
) -> Iterator[tuple[float, Pose | None]]:
    """Yield poses whose limbs are exchanged between left and right where that is clearly closer.

    Arms, legs and the whole body are compared with the last pose. Limits: the first pose of a track
    is taken to be right (see `facing_wall`). A real crossing of hands or feet between two frames is
    not a move that a climber makes, so it is undone until `MAX_EXCHANGE_S` have passed.

    Parameters
    ----------
    poses : time in seconds and pose of each frame, in order.
    """
    last: Pose | None = None
    seen = exchanged_since = -np.inf
    for time, pose in poses:
        if time <= seen:
            raise InputError(f"a pose at {time} s follows one at {seen} s")
        if pose is None:
            yield time, None
            continue
        order = np.arange(POINTS)
        if last is not None and time - seen <= MAX_GAP_S:
            order = _best_point_order(last, pose)
        if (order == np.arange(POINTS)).all():
            exchanged_since = np.inf
        else:
            exchanged_since = min(exchanged_since, time)
            if time - exchanged_since >= MAX_EXCHANGE_S:
                order, exchanged_since = np.arange(POINTS), np.inf
        pose = replace(pose, points=pose.points[order], confidence=pose.confidence[order])
        last, seen = pose, time
        yield time, pose


@dataclass(frozen=True, eq=False)
class _State:
    """The filter's state: time in s, (33, 2) positions in pixels, (33, 2) speeds in pixels/s."""

    time: float
    points: Floats
    speeds: Floats

    def moved(self, time: float, pose: Pose) -> _State:
        """Return the state after another pose."""
        step = time - self.time
        raw = (pose.points - self.points) / step
        speeds = self.speeds + _filter_weight(np.array(SPEED_CUTOFF_HZ), step) * (raw - self.speeds)
        relative = np.hypot(*speeds.T) / max(pose.region.size, 1e-9)  # sides of the square per s
        share = _filter_weight(MIN_CUTOFF_HZ + CUTOFF_PER_SPEED * relative, step)
        share = share * pose.confidence.clip(_MIN_CONFIDENCE, _FULL_CONFIDENCE) / _FULL_CONFIDENCE
        return _State(time, self.points + share[:, None] * (pose.points - self.points), speeds)


def _filter_weight(cutoff: Floats, step: float) -> Floats:
    """Return the weight of a new value in a low-pass filter: cutoff in Hz, step in s."""
    return 1 / (1 + 1 / (2 * np.pi * cutoff * step))


def _best_point_order(last: Pose, pose: Pose) -> NDArray[np.int64]:
    """Return the (33,) rows of a pose in the order that continues the last one best."""
    order = np.arange(POINTS)
    for group in GROUPS:
        kept = order[list(group)]
        exchanged = order[[_opposite_point(point) for point in group]]
        weights = np.minimum(last.confidence[list(group)], pose.confidence[kept])
        weights = np.maximum(weights, 1e-3)
        apart, closer = (
            float(
                np.average(
                    np.hypot(*(pose.points[rows] - last.points[list(group)]).T), weights=weights
                )
            )
            for rows in (kept, exchanged)
        )
        if apart >= _MIN_APART * pose.region.size and closer < _CLEARLY * apart:
            order[list(group)] = exchanged
            if group is _ALL:
                break
    return order


def _opposite_point(point: int) -> int:
    """Return the point on the other side of the body; below the head left points are odd."""
    return point + 1 if point % 2 else point - 1
