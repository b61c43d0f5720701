"""Find the camera of each frame of a clip in the scan of its wall.

About one frame a second is localised by the scan's photos. Between two of them, the points that
agreed are followed by optical flow, and the camera follows from them: a wall needs not be flat, and
a phone in the hand may walk. As long as the picture stands still, so does the camera. The focal
length is one for the clip: the median of those of the localised frames.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.images.people import find_people
from walltopo.reconstruct.localise import MIN_INLIERS, Localiser, Location, solve_pose
from walltopo_climb.beta.refusal import ClipError

Image = NDArray[np.uint8]
Floats = NDArray[np.float64]

_KEY_S: Final = 1.0  # between localised frames of a phone that moves
_RETRY_S: Final = 0.5  # after a frame that was not localised
_STILL: Final = 0.001  # median move of the followed points, in longer sides: a still phone
_LOST: Final = 0.4  # share of a localised frame's points below which the next is localised
_FLOW_ERROR: Final = 0.0008  # of a point followed forth and back, in longer sides
_FOLLOWED: Final = 400  # points, about
_WINDOW: Final = 21  # pixels, of the optical flow
_BRIDGED_S: Final = 1.0  # a longer gap without a camera is not bridged
_MIN_PLACED: Final = 0.5  # share of the frames


@dataclass(frozen=True)
class CameraPath:
    """The camera of a clip in the frame of the scan.

    Parameters
    ----------
    camera : of all frames. cam_from_world : (F, 3, 4), in the scan's unit.
    is_placed : (F,) bool; the other frames have the pose of the placed frame before or after.
    is_still : whether the phone stood still.
    """

    camera: Camera
    cam_from_world: Floats
    is_placed: NDArray[np.bool_]
    is_still: bool


class CameraTracker:
    """Takes the frames of a clip one by one, and then returns their cameras."""

    def __init__(self, localiser: Localiser) -> None:
        self._localiser = localiser
        self._frames: list[_Frame] = []
        self._size = (0, 0)  # width, height
        self._track: _Track | None = None
        self._tried = -np.inf  # time of the last localisation

    def observe(self, time: float, frame: Image) -> None:
        """Take the next frame: (H, W, 3) uint8 RGB, all of one size."""
        grey = cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)
        size = (frame.shape[1], frame.shape[0])
        if self._frames and self._size != size:
            raise ClipError("no-video", "its frames change their size")
        self._size = size
        if self._track is not None:
            self._track.follow(np.asarray(grey, np.uint8))
        if self._is_due(time):
            self._localise(time, frame, np.asarray(grey, np.uint8))
        track = self._track
        if track is None or len(track.pixels) < MIN_INLIERS:
            self._frames.append(_Frame(time))
            return
        key = track.key if track.stands else len(self._frames)
        self._frames.append(_Frame(time, track.pixels, track.points, track.focal, key))

    def _is_due(self, time: float) -> bool:
        track = self._track
        if track is None or track.is_lost:
            return time - self._tried >= _RETRY_S
        return not track.stands and time - self._tried >= _KEY_S

    def _localise(self, time: float, frame: Image, grey: Image) -> None:
        """Localise a frame; go on with the points followed so far if that fails."""
        hidden = np.zeros(grey.shape, np.bool_)
        for person in find_people(frame):
            x0, y0, x1, y1 = (round(side) for side in person.box)
            hidden[y0:y1, x0:x1] = True
        features = self._localiser.find_features(frame, hidden)
        found = self._localiser.localise(features)
        self._tried = time
        if found is not None:
            self._track = _Track(found, grey, len(self._frames))

    def path(self) -> CameraPath:
        """Return the cameras of all frames.

        Raises
        ------
        ClipError : the clip does not show the wall of the scan, or in less than half of its time.
        """
        placed = [frame for frame in self._frames if frame.key is not None]
        if not placed:
            raise ClipError(
                "other-wall",
                "the clip does not show this wall, or not enough of it",
                "Film so that some metres of the wall around the climber are in the picture. "
                "After a reset, the wall needs a new scan.",
            )
        if len(placed) < _MIN_PLACED * len(self._frames):
            raise ClipError(
                "unsteady",
                f"only {len(placed)} of {len(self._frames)} frames show where on the wall they are",
                "Keep the wall around the climber in the picture, and move the phone slowly.",
            )
        width, height = self._size
        focal = float(np.median([frame.focal for frame in placed]))
        camera = Camera("SIMPLE_PINHOLE", width, height, (focal, width / 2, height / 2))
        poses = _solve_poses(self._frames, camera)
        return _bridge_gaps(np.array([frame.time for frame in self._frames]), poses, camera)


@dataclass(frozen=True, eq=False)
class _Frame:
    """A frame, and what was found in it.

    Parameters
    ----------
    pixels, points : (n, 2) and (n, 3), as in `Location`. focal : of the localised frame.
    key : number of the frame whose pose this one has: its own, or a still one's; None: no points.
    """

    time: float
    pixels: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    focal: float = 0.0
    key: int | None = None


class _Track:
    """Points of the mesh that are followed from frame to frame."""

    def __init__(self, location: Location, grey: Image, key: int) -> None:
        every = max(1, len(location.pixels) // _FOLLOWED)
        self.pixels, self.points = location.pixels[::every], location.points[::every]
        self.focal, self.key = location.camera.fx, key
        self._first, self._count, self._grey = self.pixels, len(self.pixels), grey

    @property
    def is_lost(self) -> bool:
        return len(self.pixels) < max(_LOST * self._count, MIN_INLIERS)

    @property
    def stands(self) -> bool:
        """Return whether the points are where they were first, in the median."""
        if not len(self.pixels):
            return False
        moved = float(np.median(np.linalg.norm(self.pixels - self._first, axis=1)))
        return moved < _STILL * max(self._grey.shape)

    def follow(self, grey: Image) -> None:
        """Move the points to the next frame; drop those that do not come back."""
        if len(self.pixels):
            before = self.pixels.astype(np.float32)[:, None]
            after, ahead = _track_points(self._grey, grey, before)
            back, behind = _track_points(grey, self._grey, after)
            error = np.linalg.norm(back[:, 0] - before[:, 0], axis=1)
            kept = ahead & behind & (error < _FLOW_ERROR * max(grey.shape))
            self.pixels = after[kept, 0].astype(np.float64)
            self.points, self._first = self.points[kept], self._first[kept]
        self._grey = grey


def _track_points(
    before: Image, after: Image, points: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return where (n, 1, 2) points of a picture lie in the next, and whether they were found."""
    window = (_WINDOW, _WINDOW)
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        before, after, points, points.copy(), winSize=window, maxLevel=3
    )
    return np.asarray(moved, np.float32), np.asarray(found)[:, 0] > 0


def _solve_poses(frames: list[_Frame], camera: Camera) -> list[Floats | None]:
    """Return the pose of each frame, (3, 4), or None."""
    poses: list[Floats | None] = []
    for number, frame in enumerate(frames):
        if frame.key is not None and frame.key < number:
            poses.append(poses[frame.key])
            continue
        size = (camera.width, camera.height)
        found = solve_pose(frame.pixels, frame.points, size, camera)
        poses.append(None if found is None else found.cam_from_world)
    return poses


def _bridge_gaps(times: Floats, poses: list[Floats | None], camera: Camera) -> CameraPath:
    """Return the path with poses in short gaps between those of both sides."""
    known = np.flatnonzero([pose is not None for pose in poses])
    if not len(known):
        raise ClipError("other-wall", "the camera's place was not found in any frame")
    found = np.array([pose for pose in poses if pose is not None])
    placed = np.zeros(len(poses), np.bool_)
    filled = np.zeros((len(poses), 3, 4))
    for number in range(len(poses)):
        after = min(int(np.searchsorted(known, number)), len(known) - 1)
        before = after if known[after] <= number else max(after - 1, 0)
        gap = times[known[after]] - times[known[before]]
        share = (times[number] - times[known[before]]) / gap if gap > 0 else 0.0
        filled[number] = _interpolate_pose(found[before], found[after], float(np.clip(share, 0, 1)))
        within = known[before] <= number <= known[after]
        placed[number] = within and gap <= _BRIDGED_S
    return CameraPath(camera, filled, placed, len(np.unique(found, axis=0)) == 1)


def _interpolate_pose(first: Floats, last: Floats, share: float) -> Floats:
    """Return the pose between two, (3, 4)."""
    u, _, v = np.linalg.svd((1 - share) * first[:, :3] + share * last[:, :3])
    centres = [-pose[:, :3].T @ pose[:, 3] for pose in (first, last)]
    rotation = u @ v
    return np.column_stack([rotation, -rotation @ ((1 - share) * centres[0] + share * centres[1])])
