"""Cameras and masks as other programs write them, for `walltopo lift`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Mask, View
from walltopo.core.files import read_json
from walltopo.imaging.photo_file import read_stored
from walltopo.scans.detections import read_coco_masks
from walltopo.scans.model import read_views

__all__ = ["attach_masks", "read_cameras", "read_masks", "read_transforms"]

# OpenGL cameras look along -z with y up, COLMAP's along +z with y down.
_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


def read_cameras(path: Path) -> list[View]:
    """Views without masks from a COLMAP model folder or a `transforms.json`.

    Raises
    ------
    InputError : neither, or unreadable.
    """
    path = Path(path)
    if path.is_dir():
        return read_views(path)
    if path.suffix.lower() == ".json":
        return read_transforms(path)
    raise InputError(f"{path}: expected a COLMAP model folder or a transforms.json")


def read_transforms(path: Path) -> list[View]:
    """Views of a NeRF-style `transforms.json` (Instant-NGP, nerfstudio), sorted by name.

    `transform_matrix` is world_from_camera in OpenGL's axes; intrinsics are per file or per
    frame: `w`, `h`, `fl_x`, `fl_y`, `cx`, `cy`, `k1`, `k2`, `p1`, `p2` (fisheye: `k1` to `k4`),
    or `camera_angle_x` where there is no focal length.
    """
    data = read_json(path)
    if not isinstance(data, dict) or not data.get("frames"):
        raise InputError(f"{path}: not a transforms.json, it has no frames")
    views = []
    for number, frame in enumerate(data["frames"]):
        try:
            world_from_gl = np.asarray(frame["transform_matrix"], dtype=np.float64)
            name = Path(frame["file_path"]).name
            camera = _camera_of({**data, **frame})
            if world_from_gl.shape not in ((3, 4), (4, 4)):
                raise ValueError(f"transform_matrix of shape {world_from_gl.shape}")
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: frame {number}: {error} is missing or wrong") from error
        full = np.eye(4)
        full[: len(world_from_gl)] = world_from_gl
        # Some exporters leave a scale in the matrix: a rotation has none.
        full[:3, :3] /= np.cbrt(np.linalg.det(full[:3, :3]))
        cam_from_world = np.asarray(np.linalg.inv(full @ _FLIP)[:3], dtype=np.float64)
        views.append(View(name, camera, cam_from_world))
    return sorted(views, key=lambda view: view.name)


def _camera_of(values: Mapping[str, Any]) -> Camera:
    width, height = int(values["w"]), int(values["h"])
    if "fl_x" in values:
        fx = float(values["fl_x"])
    else:
        fx = width / 2 / np.tan(float(values["camera_angle_x"]) / 2)
    fy = float(values.get("fl_y", fx))
    middle = float(values.get("cx", width / 2)), float(values.get("cy", height / 2))
    fisheye = values.get("camera_model") == "OPENCV_FISHEYE"
    names = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2")
    distortion = tuple(float(values.get(name, 0.0)) for name in names)
    model = "OPENCV_FISHEYE" if fisheye else "OPENCV"
    return Camera(model, width, height, (fx, fy, *middle, *distortion))


def read_masks(path: Path) -> tuple[dict[str, tuple[Mask, ...]], dict[int, str]]:
    """Masks by photo name, and class names, of a COCO file or a folder of id images.

    In a folder each PNG is a photo's masks: pixel values are object numbers within that photo
    (8 or 16 bit), 0 = none; all become class 1, "object", with score 1.
    """
    path = Path(path)
    if path.is_file():
        return read_coco_masks(path)
    files = sorted(path.glob("*.png")) if path.is_dir() else []
    if not files:
        raise InputError(f"{path}: expected a COCO file or a folder of PNG id images")
    return {file.name: _masks_of_ids(file) for file in files}, {1: "object"}


def _masks_of_ids(file: Path) -> tuple[Mask, ...]:
    image = read_stored(file)
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"{file}: expected a PNG of one channel, 8 or 16 bit, with object numbers",
            "A coloured picture of masks cannot be used: colours are not numbers.",
        )
    ids: NDArray[Any] = np.unique(image)
    return tuple(Mask.from_full(image == number, 1) for number in ids[ids > 0])


def attach_masks(views: Sequence[View], masks: Mapping[str, Sequence[Mask]]) -> list[View]:
    """Give each view its masks: by file name, else by file name without folder and suffix.

    Raises
    ------
    InputError : no photo of the masks is among the views.
    """
    by_stem = {Path(name).stem: tuple(items) for name, items in masks.items()}
    result, met = [], 0
    for view in views:
        found = masks.get(view.name, by_stem.get(Path(view.name).stem))
        met += found is not None
        result.append(view.with_masks(tuple(found or ())))
    if masks and met == 0:
        raise InputError(
            f"masks and cameras have no photo in common: masks of {sorted(masks)[0]!r}, "
            f"cameras of {views[0].name!r}",
            "They are matched by file name.",
        )
    return result
