"""Read the raw export of Polycam, which has ARKit's poses.

Source: https://github.com/PolyCam/polyform (README, "Polycam's data format"). Each photo has a JSON
file of its name with `fx`, `fy`, `cx`, `cy`, `width`, `height` and the rows `t_00` to `t_23` of
world_from_camera in ARKit's gravity-aligned frame: metres, y up, the camera looks along -z.
`corrected_cameras` belong to `corrected_images` and are optimised; `cameras` to `images`.
`raw.glb` is in a frame of its own: `mesh_info.json` has the matrix `alignmentTransform`
(column-major), whose inverse takes the mesh to the frame of the poses.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.core.files import check_name, read_json
from walltopo.core.view import MAX_SIDE
from walltopo.geometry.similarity import Similarity, nearest_rotation
from walltopo.reconstruct.poses.export import Export, PhotoFiles
from walltopo.scans.document import Coordinate, parse
from walltopo.scans.poses import posed_view

_KEYFRAMES = (("corrected_cameras", "corrected_images"), ("cameras", "images"))


class _Entry(msgspec.Struct, frozen=True):
    """The JSON file of one photo."""

    fx: Coordinate
    fy: Coordinate
    cx: Coordinate
    cy: Coordinate
    width: Annotated[float, msgspec.Meta(ge=1, le=MAX_SIDE)]
    height: Annotated[float, msgspec.Meta(ge=1, le=MAX_SIDE)]
    t_00: Coordinate
    t_01: Coordinate
    t_02: Coordinate
    t_03: Coordinate
    t_10: Coordinate
    t_11: Coordinate
    t_12: Coordinate
    t_13: Coordinate
    t_20: Coordinate
    t_21: Coordinate
    t_22: Coordinate
    t_23: Coordinate


def find_poses(path: Path) -> Path | None:
    """Return the folder of the cameras at, in or below an export; None without one."""
    for folder in (path, path / "keyframes"):
        for cameras, _ in _KEYFRAMES:
            if any((folder / cameras).glob("*.json")):
                return folder / cameras
    is_cameras = path.name in (cameras for cameras, _ in _KEYFRAMES)
    return path if is_cameras and any(path.glob("*.json")) else None


def find_photos(poses: Path) -> Path | None:
    """Return the folder of the photos of the cameras in a folder."""
    images = poses.with_name(dict(_KEYFRAMES)[poses.name])
    return images if images.is_dir() else None


def read(poses: Path, photos: PhotoFiles) -> Export:
    """Return the poses of a folder of cameras.

    Raises
    ------
    InputError : a file is damaged or lacks a value; the message names the file.
    """
    views = []
    for file in sorted(poses.glob("*.json")):
        entry = parse(read_json(file), _Entry, str(file))
        with prefix_errors(file):
            views.append(_view(check_name(file.stem), entry))
    return Export(views, metric=True, up=(0.0, 1.0, 0.0), mesh_frame=_mesh_frame(poses))


def _view(name: str, entry: _Entry) -> View:
    pose = np.array([[getattr(entry, f"t_{i}{j}") for j in range(4)] for i in range(3)])
    params = (entry.fx, entry.fy, entry.cx, entry.cy)
    camera = Camera("PINHOLE", int(entry.width), int(entry.height), params)
    return posed_view(name, camera, pose, opengl=True)


def _mesh_frame(poses: Path) -> Similarity | None:
    """Return the transform to the frame of `raw.glb`; None if the export does not have it."""
    path = poses.parent.parent / "mesh_info.json"
    if not path.is_file():
        return None
    content: Any = read_json(path)
    values = content.get("alignmentTransform") if isinstance(content, dict) else None
    if values is None:
        return None
    try:
        matrix = np.asarray(values, dtype=np.float64).reshape(4, 4).T
        scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
        if not np.isfinite(matrix).all() or not 1e-4 < scale < 1e4:
            raise ValueError("not a rotation and a position")
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: alignmentTransform: expected 16 numbers ({error})") from error
    return Similarity(scale, nearest_rotation(matrix[:3, :3]), matrix[:3, 3])
