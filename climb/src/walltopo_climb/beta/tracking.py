"""Follow the climber through a clip.

A clip may show several people: a spotter, someone who rests, someone on the next problem. **The
climber is the first person who moves up by `MIN_RISE`:** head, hips and the lower foot alike. A
spotter's feet stay on the ground, even if the spotter reaches up, squats or stands up. Someone who
walks away from the camera moves up in the picture by the feet, but not by the head. If no one moves
up within `MAX_WAIT_S`, the climber is the person who moved up furthest; if no one moved, the person
whose feet are highest in the picture.

Limits: the camera must be still or pan little until the climber is chosen, because positions are
those in the picture. Someone who climbs a ladder, or another problem, before the climber starts is
followed instead. If two people cross, their tracks may be exchanged. At most `MAX_PEOPLE` people
count at a time, those of the highest scores. Holds look like bodies to the network of poses: if the
climber falls, poses of what is left there may follow for `MAX_UNSEEN_S`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from walltopo.core import InputError
from walltopo_climb.beta.pose import (
    FEET,
    MIN_SCORE,
    Floats,
    Image,
    Point,
    Pose,
    PoseReader,
    Region,
    check_frame,
    shipped_networks,
)

# A body's square is about 2.3 m wide (1.25 times the circle around the whole body).
MIN_RISE = 0.25  # in sides of the square: about .6 m
MAX_WAIT_S = 20.0
MAX_PEOPLE = 4
_MAX_WAIT_FRAMES = 1200  # memory of the wait: four poses of 1 kB for each frame
_SEARCH_S = 0.5  # between searches for further people
_SEARCH_LOST_S = 0.3  # between searches if nobody is followed
_CHECK_S = 1.0  # between checks that the climber is a person
MAX_UNSEEN_S = 2.5  # without a passed check, after which the climber counts as lost
_MIN_MOVED = 0.05  # smaller rises, in sides of the square, are noise
_WIDER = 1.4  # side of the square in which a lost person is sought first, in sides of the last one
_SAME = 0.15  # distance of centres, in sides of the square, below which two tracks are one person
# Distance at which a lost person is found again, in sides of the square: at once, and per second.
_REACH, _REACH_PER_S = 0.3, 1.0


def find_poses(
    frames: Iterable[tuple[float, Image]], reader: PoseReader | None = None
) -> Iterator[Pose | None]:
    """Yield the climber's pose in each frame, or None where the climber is not found.

    Poses come late: until the climber is chosen, those of up to `MAX_WAIT_S` seconds are kept.
    Frames are never kept.

    Parameters
    ----------
    frames : time in seconds and (H, W, 3) uint8 RGB picture of each frame, in order.
    reader : finds bodies and reads poses; by default the shipped networks.

    Raises
    ------
    InputError : there are no frames, a frame is not a picture, or times do not increase.
    """
    networks = shipped_networks() if reader is None else reader
    checked = _check_frames(frames)
    crowd = _Crowd(networks)
    climber: _Track | None = None
    for time, frame in checked:
        crowd.observe(time, frame)
        if not crowd.tracks:
            yield None
            crowd.forget()
            continue
        climber = crowd.climber(time)
        if climber is not None:
            break
    if climber is None:
        climber = crowd.highest()
    yield from crowd.poses_of(climber)
    if climber is not None:
        crowd.forget()
        yield from _follow_person(climber, networks, checked)


@dataclass(eq=False)
class _Track:
    """A person in a clip.

    Parameters
    ----------
    region : the square around the person, for the next frame.
    seen : time at which the person was last found, seconds.
    lowest : (3,) y of head, hips and lower foot, each at its lowest so far, pixels.
    rise : furthest that the person moved up so far, in sides of the square.
    feet : y of the lower foot, pixels.
    """

    region: Region
    seen: float
    lowest: Floats = field(default_factory=lambda: np.full(3, -np.inf))
    rise: float = 0.0
    feet: float = np.inf

    def update(self, pose: Pose, time: float) -> None:
        """Take over the pose of a frame."""
        self.region, self.seen = pose.region, time
        places = pose.points[:, 1]
        head, feet = places[Point.NOSE], places[list(FEET)].max()
        hips = places[[Point.LEFT_HIP, Point.RIGHT_HIP]].mean()
        heights = np.array([head, hips, feet])
        self.feet = float(feet)
        self.lowest = np.maximum(self.lowest, heights)
        self.rise = max(self.rise, float((self.lowest - heights).min() / pose.region.size))

    def reaches(self, region: Region, time: float) -> bool:
        """Return whether a body found now may be this person, last seen some time ago."""
        reach = _REACH + _REACH_PER_S * (time - self.seen)
        return _centre_distance(self.region, region) <= reach * self.region.size


@dataclass(eq=False)
class _Crowd:
    """The people of a clip, and their poses, until one of them is known to be the climber."""

    reader: PoseReader
    tracks: list[_Track] = field(default_factory=list)
    rows: deque[dict[_Track, Pose]] = field(default_factory=deque)
    begun: float = 0.0  # time at which the first person was found
    searched: float = -np.inf

    def observe(self, time: float, frame: Image) -> None:
        """Read the poses of a frame."""
        row: dict[_Track, Pose] = {}
        for track in self.tracks:
            if time - track.seen >= MAX_UNSEEN_S:
                continue  # lost
            pose = _read_pose_of(track, self.reader, frame)
            if pose is not None and not _is_among(pose, row.values()):
                track.update(pose, time)
                row[track] = pose
        pause = _SEARCH_S if row else _SEARCH_LOST_S
        if len(row) < MAX_PEOPLE and time - self.searched >= pause:
            self._search(time, frame, row)
        if not self.rows:
            self.begun = time
        self.rows.append(row)

    def climber(self, time: float) -> _Track | None:
        """Return the person who is known to climb, or the likeliest one at the end of the wait."""
        risen = [track for track in self.tracks if track.rise >= MIN_RISE]
        if risen:
            return max(risen, key=lambda track: track.rise)
        waited = time - self.begun >= MAX_WAIT_S or len(self.rows) >= _MAX_WAIT_FRAMES
        return self.highest() if waited else None

    def highest(self) -> _Track | None:
        """Return the person who moved up furthest, else the one whose feet are highest."""

        def order(track: _Track) -> tuple[float, float]:
            return (track.rise if track.rise >= _MIN_MOVED else 0.0), -track.feet

        return max(self.tracks, key=order, default=None)

    def poses_of(self, track: _Track | None) -> Iterator[Pose | None]:
        """Yield the poses of a person in the frames so far."""
        for row in self.rows:
            yield None if track is None else row.get(track)

    def forget(self) -> None:
        """Drop the poses so far."""
        self.rows.clear()

    def _search(self, time: float, frame: Image, row: dict[_Track, Pose]) -> None:
        """Add people who are not followed yet, or whom their tracks lost, to the poses."""
        self.searched = time
        for body in self.reader.find_bodies(frame):
            if len(row) >= MAX_PEOPLE:
                break
            pose = self.reader.read_pose(frame, body.region)
            if pose.score < MIN_SCORE or _is_among(pose, row.values()):
                continue
            lost = [t for t in self.tracks if t not in row and t.reaches(pose.region, time)]
            if lost:
                track = min(lost, key=lambda t: _centre_distance(t.region, pose.region))
            else:
                track = _Track(pose.region, time)
                self.tracks.append(track)
            track.update(pose, time)
            row[track] = pose


def _follow_person(
    track: _Track, reader: PoseReader, frames: Iterable[tuple[float, Image]]
) -> Iterator[Pose | None]:
    """Yield the poses of a known person, who is searched near the last place if lost."""
    passed = checked = track.seen
    searched = -np.inf
    for time, frame in frames:
        pose: Pose | None = None
        if time - passed < MAX_UNSEEN_S:
            pose = _read_pose_of(track, reader, frame)
        if pose is not None:
            if time - checked >= _CHECK_S:
                checked = time
                passed = time if reader.shows_body(frame, pose) else passed
        elif time - searched >= _SEARCH_LOST_S:
            searched = time
            pose = _found_again(track, reader, time, frame)
            passed = checked = passed if pose is None else time
        if pose is None:
            yield None
            continue
        track.update(pose, time)
        yield pose


def _read_pose_of(track: _Track, reader: PoseReader, frame: Image) -> Pose | None:
    """Return the pose of a person in the next frame.

    A body that folds makes its square small and turned, so that the next pose lies beyond it; a
    wider one, upright, finds it again.
    """
    pose = reader.read_pose(frame, track.region)
    if pose.score >= MIN_SCORE:
        return pose
    last = track.region
    pose = reader.read_pose(frame, Region(last.x, last.y, _WIDER * last.size, 0.0))
    return pose if pose.is_clear else None


def _found_again(track: _Track, reader: PoseReader, time: float, frame: Image) -> Pose | None:
    """Return the pose of the person who is nearest to the last place of a track."""
    near = [body for body in reader.find_bodies(frame) if track.reaches(body.region, time)]
    if not near:
        return None
    nearest = min(near, key=lambda body: _centre_distance(track.region, body.region))
    pose = reader.read_pose(frame, nearest.region)
    return pose if pose.score >= MIN_SCORE else None


def _is_among(pose: Pose, others: Iterable[Pose]) -> bool:
    """Return whether a pose is that of a person who has one of the other poses."""
    return any(
        _centre_distance(pose.region, other.region) <= _SAME * other.region.size for other in others
    )


def _centre_distance(a: Region, b: Region) -> float:
    """Return the distance of two squares' centres, pixels."""
    return float(np.hypot(a.x - b.x, a.y - b.y))


def _check_frames(frames: Iterable[tuple[float, Any]]) -> Iterator[tuple[float, Image]]:
    """Yield the frames; refuse what cannot be a clip."""
    last, number = -np.inf, -1
    for number, (time, frame) in enumerate(frames):
        if not time > last or not np.isfinite(time):
            raise InputError(f"frame {number}: its time, {time} s, is not later than {last} s")
        last = time
        yield float(time), check_frame(frame, number)
    if number < 0:
        raise InputError("the clip has no frames")
