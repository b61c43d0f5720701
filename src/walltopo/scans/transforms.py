"""Read a NeRF-style `transforms.json` (Instant-NGP, nerfstudio)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import naming
from walltopo.core.files import check_name, read_json
from walltopo.core.view import MAX_SIDE
from walltopo.scans.document import Coordinate, check_once, parse
from walltopo.scans.poses import posed_view

Row = tuple[Coordinate, Coordinate, Coordinate, Coordinate]

Pixels = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]

Side = Annotated[float, msgspec.Meta(ge=1, le=MAX_SIDE)]  # float: some exporters write 1280.0


class _Frame(msgspec.Struct, frozen=True):
    """A frame of a `transforms.json`, merged with the values that apply to all frames."""

    file_path: str
    transform_matrix: Annotated[tuple[Row, ...], msgspec.Meta(min_length=3, max_length=4)]
    w: Side
    h: Side
    fl_x: Pixels | None = None
    fl_y: Pixels | None = None
    camera_angle_x: Annotated[float, msgspec.Meta(gt=0, lt=3.14)] | None = None
    cx: Pixels | None = None
    cy: Pixels | None = None
    k1: Coordinate = 0.0
    k2: Coordinate = 0.0
    k3: Coordinate = 0.0
    k4: Coordinate = 0.0
    p1: Coordinate = 0.0
    p2: Coordinate = 0.0
    camera_model: str = ""


def read_transforms(path: Path) -> list[View]:
    """Return the views of a NeRF-style `transforms.json` (Instant-NGP, nerfstudio), by name.

    `transform_matrix` is world_from_camera with OpenGL's axes. Intrinsics are per file or per
    frame: `w`, `h`, `fl_x`, `fl_y`, `cx`, `cy`, `k1`, `k2`, `p1`, `p2` (fisheye: `k1` to `k4`),
    or `camera_angle_x` instead of a focal length.
    """
    data = read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("frames"), list) or not data["frames"]:
        raise InputError(f"{path}: not a transforms.json: it has no frames")
    views: list[View] = []
    for number, frame in enumerate(data["frames"]):
        merged = {**data, **frame} if isinstance(frame, dict) else frame
        where = f"{path}: frame {number}"
        entry = parse(merged, _Frame, where)
        with naming(where):
            views.append(_view(entry))
    with naming(path):
        check_once("a photo named", (view.name for view in views))
    return sorted(views, key=lambda view: view.name)


def _view(frame: _Frame) -> View:
    name = check_name(Path(frame.file_path).name)
    pose = np.array(frame.transform_matrix)
    return posed_view(name, _camera_of(frame), pose, opengl=True)


def _camera_of(frame: _Frame) -> Camera:
    width, height = frame.w, frame.h
    if frame.fl_x is not None:
        fx = frame.fl_x
    elif frame.camera_angle_x is not None:
        fx = width / 2 / float(np.tan(frame.camera_angle_x / 2))
    else:
        raise InputError("has neither fl_x nor camera_angle_x")
    fy = fx if frame.fl_y is None else frame.fl_y
    cx = width / 2 if frame.cx is None else frame.cx
    cy = height / 2 if frame.cy is None else frame.cy
    last = (frame.k3, frame.k4)
    model = "OPENCV_FISHEYE" if frame.camera_model == "OPENCV_FISHEYE" else "OPENCV"
    if model == "OPENCV":
        last = (frame.p1, frame.p2)
    return Camera(model, int(width), int(height), (fx, fy, cx, cy, frame.k1, frame.k2, *last))
