"""Read a clip of an attempt on a scanned wall: the camera, the climber, the holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.parallel import map_ahead
from walltopo.core.progress import Progress, Silent
from walltopo.reconstruct.ingest.video import LongVideoError, timed_frames
from walltopo_climb.beta.attempt import Attempt, attempt_of
from walltopo_climb.beta.camera_path import CameraPath, CameraTracker
from walltopo_climb.beta.in_view import Frames, WallHolds
from walltopo_climb.beta.limbs import frames_of
from walltopo_climb.beta.refusal import ClipError
from walltopo_climb.beta.scanned_wall import ScannedWall
from walltopo_climb.beta.smoothing import smoothed
from walltopo_climb.beta.tracking import find_poses

TimedFrame = tuple[float, NDArray[np.uint8]]

RATE: Final = 10.0  # frames per second that are read
MAX_SECONDS: Final = 180.0
_MAX_SIDE: Final = 1280  # pixels
_MIN_FRAMES: Final = 10
_AHEAD: Final = 4  # frames whose camera is found before their body is read


@dataclass(frozen=True, eq=False)
class ClipReading:
    """An attempt as a clip shows it.

    Parameters
    ----------
    frames : the limbs, with cameras in metres. holds : those that the clip's camera sees.
    path : the camera, in scan units.
    """

    attempt: Attempt
    frames: Frames
    holds: WallHolds
    path: CameraPath


def read_clip(
    clip: Path,
    wall: ScannedWall,
    route: int | None = None,
    progress: Progress | None = None,
    max_seconds: float = MAX_SECONDS,
) -> ClipReading:
    """Return the attempt that a clip shows.

    Parameters
    ----------
    clip : a video. route : id of the route, if it is known; else the one that fits best.

    Raises
    ------
    ClipError : the file is not a video, too long or too short; it does not show the wall; or it
        shows nobody who climbs.
    InputError : no route has this id.
    """
    if route is not None and all(one.id != route for one in wall.routes):
        raise InputError(f"the wall has no route {route}")
    report = progress or Silent()
    with prefix_errors(clip):
        report.step("reading the clip")
        tracker, times = CameraTracker(wall.localiser), list[float]()

        def observed(one: TimedFrame) -> TimedFrame:
            tracker.observe(*one)
            return one

        def watched() -> Iterator[TimedFrame]:
            # The camera is found ahead of the body, in a thread of its own.
            frames = _frames_of(clip, max_seconds)
            for time, frame in map_ahead(observed, frames, threads=1, buffered=_AHEAD):
                times.append(time)
                report.advance()
                yield time, frame

        poses = list(find_poses(watched()))
        if len(times) < _MIN_FRAMES:
            raise ClipError("too-short", f"has {len(times)} frames: too short for an attempt")
        path = tracker.path()
        at = np.array(times)
        metric = path.cam_from_world.copy()
        metric[:, :, 3] /= wall.unit
        steady = list(smoothed(zip(times, poses, strict=True)))
        frames = frames_of(at, steady, path.camera, metric)
        frames = replace(frames, confidence=frames.confidence * path.is_placed[:, None])
        holds = wall.holds_seen_from(_middle_eye(metric))
    return ClipReading(attempt_of(frames, holds, wall.routes, route), frames, holds, path)


def _frames_of(clip: Path, max_seconds: float) -> Iterator[TimedFrame]:
    try:
        yield from timed_frames(clip, RATE, max_seconds, _MAX_SIDE)
    except LongVideoError as error:
        raise ClipError("too-long", error.message, error.hint) from error
    except InputError as error:
        raise ClipError("no-video", error.message, error.hint) from error


def _middle_eye(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3,) median of the cameras' centres."""
    centres = -np.einsum("fji,fj->fi", poses[:, :, :3], poses[:, :, 3])
    return np.asarray(np.median(centres, axis=0))
