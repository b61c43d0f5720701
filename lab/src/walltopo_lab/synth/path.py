"""The phone's path: the camera pose of each photo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo_lab.synth.bodies import Facet
from walltopo_lab.synth.hall import Section, Stand, moved_pose
from walltopo_lab.synth.params import GymSettings, PhotoSettings

Floats = NDArray[np.float64]

_LINKING = 5  # photos at the gap between two walls of a hall


def phone_camera(settings: PhotoSettings) -> Camera:
    """Return a SIMPLE_RADIAL camera with the 35 mm focal length along the longer side."""
    focal = settings.focal_35mm / 36.0 * max(settings.width, settings.height)
    centre = settings.width / 2, settings.height / 2
    return Camera("SIMPLE_RADIAL", settings.width, settings.height, (focal, *centre, settings.k1))


def look_at(eye: Floats, target: Floats, roll: float) -> Floats:
    """Return the (3, 4) cam_from_world of a camera at `eye` with `target` in its centre, z up."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    c, s = np.cos(roll), np.sin(roll)
    rotation = np.stack([c * right + s * down, -s * right + c * down, forward])
    return np.column_stack([rotation, -rotation @ eye])


def _wall_front(wall: list[Facet], x: float) -> tuple[float, float]:
    """Return y of the wall's foot at x and y of the wall's most forward point nearby."""
    points = np.concatenate([f.corners for f in wall])
    foot = points[points[:, 2] < 0.01]
    foot = foot[np.argsort(foot[:, 0])]
    near = points[np.abs(points[:, 0] - x) < 1.6]
    forward = near[:, 1].min() if len(near) else points[:, 1].min()
    return float(np.interp(x, foot[:, 0], foot[:, 1])), float(forward)


def walk_hall(
    sections: Sequence[Section],
    gym: GymSettings,
    photos: PhotoSettings,
    rng: np.random.Generator,
) -> list[Floats]:
    """Return cam_from_hall of every photo, wall by wall; the last photos of a wall show the next
    too.
    """
    poses = []
    ends = [photos.photos * k // len(sections) for k in range(len(sections) + 1)]
    for section, first, last in zip(sections, ends, ends[1:], strict=False):
        count = last - first
        linking = 0 if section.stand is None else min(_LINKING, count // 4)
        own = replace(photos, photos=count - linking) if count - linking else None
        taken = [] if own is None else walk_poses(section.wall, section.plates, gym, own, rng)
        if section.stand is not None:
            taken += [_joint_photo(section.stand, gym, photos, rng) for _ in range(linking)]
        poses += [moved_pose(pose, section.hall_from_wall) for pose in taken]
    return poses


def _joint_photo(
    stand: Stand, gym: GymSettings, photos: PhotoSettings, rng: np.random.Generator
) -> Floats:
    """Return a pose that shows the end of a wall and the beginning of the next."""
    joint = stand.joint
    inward = (stand.middle - joint) / np.linalg.norm(stand.middle - joint)
    depth = rng.uniform(photos.distance_low, photos.distance_high) + 0.5
    along = np.array([-inward[1], inward[0], 0.0])
    eye = joint + inward * depth + along * rng.normal(0, 0.5)
    eye[2] = np.clip(rng.normal(1.55, 0.12), 1.1, 2.1)
    aim = joint + along * rng.uniform(-0.7, 0.7)
    aim[2] = gym.height * rng.uniform(0.3, 0.6)
    return look_at(eye, aim, np.radians(rng.normal(0, photos.roll_deg)))


def walk_poses(
    wall: list[Facet],
    plates: list[Facet],
    gym: GymSettings,
    photos: PhotoSettings,
    rng: np.random.Generator,
) -> list[Floats]:
    """Return cam_from_world of every photo: passes along the wall, then the scale plates.

    Each pass covers the wall's length at another distance and height of aim. Neighbouring photos
    overlap, because the eye moves evenly and always looks at the wall.
    """
    at_plates = round(photos.photos * photos.measure_share) if plates else 0
    count = photos.photos - at_plates
    points = np.concatenate([f.corners for f in wall])
    low, high = points[:, 0].min(), points[:, 0].max()
    passes = max(1, round(count / max(5.0, 1.6 * (high - low) + 2)))
    poses = []
    for k in range(count):
        lap, t = divmod(k * passes / count, 1.0)
        stop = _Stop(k, int(lap), passes, t if int(lap) % 2 == 0 else 1 - t)
        poses.append(_wall_photo(wall, gym, photos, (low, high), stop, rng))
    for k in range(at_plates):
        poses.append(_plate_photo(wall, plates[k % len(plates)], k // len(plates), gym, rng))
    return poses


@dataclass(frozen=True)
class _Stop:
    """A place on the path: its number, its pass of all passes, and 0 to 1 along the wall."""

    number: int
    lap: int
    passes: int
    along: float


def _wall_photo(
    wall: list[Facet],
    gym: GymSettings,
    photos: PhotoSettings,
    span: tuple[float, float],
    stop: _Stop,
    rng: np.random.Generator,
) -> Floats:
    """Return the pose of a photo of the wall, whose x runs from `span[0]` to `span[1]`."""
    low, high = span
    lap, t = stop.lap, stop.along
    margin = min(0.3 * (high - low), 1.1)
    aim_x = low + margin + t * (high - low - 2 * margin) + rng.normal(0, 0.12)
    x = aim_x + rng.normal(0, 0.35) + 0.5 * np.sin(7.0 * t + lap)
    foot, forward = _wall_front(wall, aim_x)
    depth = photos.distance_low + (photos.distance_high - photos.distance_low) * (
        ((lap + 0.5) / stop.passes + rng.uniform(-0.25, 0.25)) % 1.0
    )
    y = 0.5 * (foot + forward) - depth
    y = min(y, forward - 1.1)  # keep the eye out from under the overhang
    z = float(np.clip(rng.normal(1.55, 0.12), 1.1, 2.1))
    share = (0.50, 0.66, 0.38, 0.58, 0.74, 0.32)[lap % 6]
    if gym.height > 6:  # cover tall walls from the ground in tiers, one photo each
        share = (0.22, 0.45, 0.72, 0.42)[stop.number % 4]
    aim = np.array([aim_x, 0.5 * (foot + forward), gym.height * (share + rng.normal(0, 0.03))])
    roll = np.radians(rng.normal(0, photos.roll_deg))
    return look_at(np.array([x, y, z]), aim, roll)


def _plate_photo(
    wall: list[Facet], plate: Facet, turn: int, gym: GymSettings, rng: np.random.Generator
) -> Floats:
    """Return a pose that shows a scale plate and the wall behind it."""
    centre = plate.corners.mean(axis=0)
    side = (-0.6, 0.55, -0.2, 0.25, 0.9, -0.95)[turn % 6] + rng.normal(0, 0.1)
    eye = np.array([centre[0] + side, centre[1] - rng.uniform(1.4, 1.7), rng.uniform(1.5, 1.75)])
    foot, _ = _wall_front(wall, centre[0])
    aim = np.array([centre[0] - 0.15 * side, 0.2 * centre[1] + 0.8 * foot, 0.3])
    return look_at(eye, aim, np.radians(rng.normal(0, 2.0)))
