"""Read the export of Record3D (`metadata` or `metadata.json`, and numbered photos).

Source: nerfstudio's `record3d_utils.py`. `poses` holds for each photo, by its number, the rotation
`qx qy qz qw` and position of world_from_camera in ARKit's gravity-aligned frame: metres, y up, the
camera looks along -z. `K` is the calibration (column-major) of photos of `w` x `h` pixels. As
there, the principal point is the middle of the photo: that of `K` is of the turned sensor.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.core.files import read_json
from walltopo.core.view import MAX_SIDE
from walltopo.reconstruct.poses.export import Export, PhotoFiles
from walltopo.scans.document import Coordinate, parse
from walltopo.scans.poses import posed_view

_Side = Annotated[float, msgspec.Meta(ge=1, le=MAX_SIDE)]
_Nine = Annotated[tuple[Coordinate, ...], msgspec.Meta(min_length=9, max_length=9)]
_Seven = Annotated[tuple[Coordinate, ...], msgspec.Meta(min_length=7, max_length=7)]


class _Metadata(msgspec.Struct, frozen=True):
    """The part of `metadata` that gives poses."""

    w: _Side
    h: _Side
    K: _Nine
    poses: tuple[_Seven, ...]


def find_poses(path: Path) -> Path | None:
    """Return the metadata at or in a path; None if it has no poses of this form."""
    named = [path / "metadata", path / "metadata.json"] if path.is_dir() else [path]
    for file in named:
        if file.name in ("metadata", "metadata.json") and file.is_file():
            return file
    return None


def find_photos(poses: Path) -> Path | None:
    """Return the folder of the photos beside the metadata."""
    for name in ("rgb", "rgbd", "images"):
        folder = poses.with_name(name)
        if folder.is_dir():
            return folder
    return None


def read(poses: Path, photos: PhotoFiles) -> Export:
    """Return the poses of the metadata; the photos are named by their numbers.

    Raises
    ------
    InputError : the file is damaged or lacks a value; the message names the file.
    """
    content = parse(read_json(poses), _Metadata, str(poses))
    focal_x, focal_y = content.K[0], content.K[4]
    width, height = int(content.w), int(content.h)
    with prefix_errors(poses):
        camera = Camera(
            "PINHOLE", width, height, (focal_x, focal_y or focal_x, width / 2, height / 2)
        )
        views = [_view(k, row, camera) for k, row in enumerate(content.poses)]
    return Export(views, metric=True, up=(0.0, 1.0, 0.0))


def _view(number: int, row: tuple[float, ...], camera: Camera) -> View:
    from scipy.spatial.transform import Rotation

    if not np.linalg.norm(row[:4]) > 0.5:
        raise InputError(f"pose {number}: {row[:4]} is not a rotation")
    pose = np.column_stack([Rotation.from_quat(row[:4]).as_matrix(), row[4:]])
    return posed_view(str(number), camera, pose, opengl=True)
