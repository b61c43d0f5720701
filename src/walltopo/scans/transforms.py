"""Read a NeRF-style `transforms.json` (Instant-NGP, nerfstudio)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Annotated

import msgspec
import numpy as np

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.core.files import check_name, read_json
from walltopo.core.view import MAX_SIDE
from walltopo.scans.document import Coordinate, check_once, parse
from walltopo.scans.poses import posed_view

# UTM has northings of ten million metres; a scan's poses are shifted (`poses.json`: `origin`).
MatrixNumber = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]
Row = tuple[MatrixNumber, MatrixNumber, MatrixNumber, MatrixNumber]

Pixels = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]

Side = Annotated[float, msgspec.Meta(ge=1, le=MAX_SIDE)]  # float: some exporters write 1280.0


class _Frame(msgspec.Struct, frozen=True):
    """A frame of a `transforms.json`, merged with the values that apply to all frames."""

    file_path: str
    transform_matrix: Annotated[tuple[Row, ...], msgspec.Meta(min_length=3, max_length=4)]
    w: Side | None = None
    h: Side | None = None
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
    is_fisheye: bool = False


# Values of `camera_model`, and whether they mean a fisheye lens.
_MODELS = {
    "": False,
    "SIMPLE_PINHOLE": False,
    "PINHOLE": False,
    "SIMPLE_RADIAL": False,
    "RADIAL": False,
    "OPENCV": False,
    "FULL_OPENCV": False,
    "OPENCV_FISHEYE": True,
    "SIMPLE_RADIAL_FISHEYE": True,
    "RADIAL_FISHEYE": True,
}
_UNDISTORT = "Undistort the photos first; then all lens parameters are 0."
# Names of lens parameters; those that are no field of `_Frame` are not understood.
_LENS = re.compile(r"[kpsb]\d+|skew|distortion.*")


def read_transforms(path: Path, sizes: Mapping[str, tuple[int, int]] | None = None) -> list[View]:
    """Return the views of a NeRF-style `transforms.json` (Instant-NGP, nerfstudio), by name.

    `transform_matrix` is world_from_camera with OpenGL's axes. Intrinsics are per file or per
    frame: `w`, `h`, `fl_x`, `fl_y`, `cx`, `cy`, `k1`, `k2`, `k3`, `p1`, `p2` (fisheye: `k1` to
    `k4`), or `camera_angle_x` instead of a focal length. A view is named by its `file_path`
    without the folders that all frames share.

    Parameters
    ----------
    sizes : (width, height) by photo name, for frames without `w` and `h`. Photos are matched by the
        last part of their name, without its suffix; one size of all photos serves any frame.

    Raises
    ------
    InputError : the file is not a `transforms.json`; or a frame has an invalid value, no size, or a
        lens parameter that is not understood and not zero.
    """
    data = read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("frames"), list) or not data["frames"]:
        raise InputError(f"{path}: not a transforms.json: it has no frames")
    by_stem = {PurePosixPath(name).stem: size for name, size in (sizes or {}).items()}
    views: list[View] = []
    for number, frame in enumerate(data["frames"]):
        merged = {**data, **frame} if isinstance(frame, dict) else frame
        where = f"{path}: frame {number}"
        entry = parse(merged, _Frame, where)
        with prefix_errors(where):
            _check_lens(merged)
            views.append(_view(entry, by_stem))
    views = _without_shared_folders(views)
    with prefix_errors(path):
        check_once("a photo named", (view.name for view in views))
    return sorted(views, key=lambda view: view.name)


def _check_lens(frame: Mapping[str, object]) -> None:
    """Raise InputError for a lens parameter that is not understood and not zero."""
    unknown = [
        name
        for name, value in frame.items()
        if _LENS.fullmatch(name) and name not in _Frame.__struct_fields__ and value
    ]
    if unknown:
        raise InputError(
            f"the lens parameter {unknown[0]} is not understood",
            _UNDISTORT,
        )


def _without_shared_folders(views: list[View]) -> list[View]:
    """Return the views named without the folders that the names of all of them begin with."""
    parts = [PurePosixPath(view.name).parts for view in views]
    shared = 0
    while len({row[: shared + 1] for row in parts}) == 1 and all(
        len(row) > shared + 1 for row in parts
    ):
        shared += 1
    return [
        replace(view, name=PurePosixPath(*row[shared:]).as_posix())
        for view, row in zip(views, parts, strict=True)
    ]


def _view(frame: _Frame, sizes: Mapping[str, tuple[int, int]]) -> View:
    # Folders such as ../images or /home/me/images are the exporter's, not the photo's.
    parts = PurePosixPath(frame.file_path.replace("\\", "/")).parts
    name = PurePosixPath(*(part for part in parts if part not in ("/", ".."))).as_posix()
    size = sizes.get(PurePosixPath(name).stem)
    if size is None and len(every := set(sizes.values())) == 1:
        (size,) = every
    pose = np.array(frame.transform_matrix)
    return posed_view(check_name(name if parts else ""), _camera_of(frame, size), pose, opengl=True)


def _camera_of(frame: _Frame, size: tuple[int, int] | None) -> Camera:
    if frame.w is not None and frame.h is not None:
        width, height = frame.w, frame.h
    elif size is not None:
        width, height = size
    else:
        raise InputError("has no size (w, h), and there are no masks of this photo to take it from")
    if frame.fl_x is not None:
        fx = frame.fl_x
    elif frame.camera_angle_x is not None:
        fx = width / 2 / float(np.tan(frame.camera_angle_x / 2))
    else:
        raise InputError("has neither fl_x nor camera_angle_x")
    fy = fx if frame.fl_y is None else frame.fl_y
    cx = width / 2 if frame.cx is None else frame.cx
    cy = height / 2 if frame.cy is None else frame.cy
    if frame.camera_model not in _MODELS:
        raise InputError(
            f"camera_model {frame.camera_model!r} is not supported; expected one of "
            f"{', '.join(name for name in _MODELS if name)}",
            "Export the photos as pictures of a perspective camera.",
        )
    size_and_pinhole = int(width), int(height), (fx, fy, cx, cy)
    if _MODELS[frame.camera_model] or frame.is_fisheye:
        return _lens("OPENCV_FISHEYE", *size_and_pinhole, (frame.k1, frame.k2, frame.k3, frame.k4))
    lens = (frame.k1, frame.k2, frame.p1, frame.p2)
    if frame.k4:
        # nerfstudio's k4 is a factor of r^8, which no model here has; OpenCV's k4 is a divisor's.
        raise InputError("k4 is not supported for a lens that is not a fisheye", _UNDISTORT)
    if frame.k3:
        return _lens("FULL_OPENCV", *size_and_pinhole, (*lens, frame.k3, 0.0, 0.0, 0.0))
    return _lens("OPENCV", *size_and_pinhole, lens)


def _lens(
    model: str,
    width: int,
    height: int,
    pinhole: tuple[float, float, float, float],
    distortion: tuple[float, ...],
) -> Camera:
    return Camera(model, width, height, (*pinhole, *distortion))
