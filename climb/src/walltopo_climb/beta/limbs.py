"""The places where the limbs of a followed body touch the wall, as frames for the contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from walltopo.core import Camera, InputError
from walltopo_climb.beta.in_view import LIMBS, Floats, Frames
from walltopo_climb.beta.pose import Point, Pose
from walltopo_climb.beta.refusal import ClipError

# The fingers lie on the hold, the wrist below it; climbers stand on the toes.
_TOUCHING: Final = (
    (Point.LEFT_INDEX, Point.LEFT_LITTLE_FINGER, Point.LEFT_THUMB),
    (Point.RIGHT_INDEX, Point.RIGHT_LITTLE_FINGER, Point.RIGHT_THUMB),
    (Point.LEFT_TOES,),
    (Point.RIGHT_TOES,),
)
_HIPS: Final = (Point.LEFT_HIP, Point.RIGHT_HIP)


def frames_of(
    times: Floats,
    poses: Sequence[Pose | None],
    camera: Camera,
    cam_from_world: Floats,
) -> Frames:
    """Return the limbs of a track in frames with known cameras.

    A frame without a pose keeps the places of the frame before, with confidence 0.

    Parameters
    ----------
    times : (F,) s. poses : of the same frames. camera : of the clip. cam_from_world : (F, 3, 4) m.

    Raises
    ------
    ClipError : no frame has a pose. InputError : the numbers of frames differ.
    """
    if len(poses) != len(times):
        raise InputError(f"{len(times)} times for {len(poses)} poses")
    if not any(pose is not None for pose in poses):
        raise ClipError(
            "no-climber", "no frame shows a climber", "Film the whole body, from the ground."
        )
    points = np.zeros((len(times), LIMBS, 2))
    confidence = np.zeros((len(times), LIMBS))
    hips = np.zeros((len(times), 2))
    last = next(pose for pose in poses if pose is not None)
    for frame, pose in enumerate(poses):
        last = last if pose is None else pose
        hips[frame] = last.points[list(_HIPS)].mean(axis=0)
        for limb, rows in enumerate(_TOUCHING):
            points[frame, limb] = last.points[list(rows)].mean(axis=0)
            if pose is not None:
                confidence[frame, limb] = pose.score * pose.confidence[list(rows)].min()
    return Frames(times, points, confidence, hips, camera, cam_from_world)
