"""Inputs of `walltopo lift` that are well-formed and mean something else."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

_SIZE = {"width": 128, "height": 96}
_SQUARE = [[50, 40, 70, 40, 70, 60, 50, 60]]
_PLATE = ((-1, -1), (1, -1), (1, 1), (-1, 1))  # metres
_DRACO = {"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]}


def _scene(
    root: Path,
    cameras: tuple[str, ...] = ("0.jpg", "1.jpg"),
    photos: tuple[str, ...] = ("0.jpg", "1.jpg"),
    size: dict[str, int] = _SIZE,
    segmentation: Any = _SQUARE,
    scale: float = 1.0,
    shift: float = 0.0,
    mesh: str = "wall.obj",
    **lens: Any,
) -> list[str]:
    """Write a plate, two cameras 2 m in front of it and a mask in each; return the arguments."""
    frames = []
    for number, name in enumerate(cameras):
        pose = np.eye(4)
        pose[:3, 3] = 0.2 * number, 0, 2
        frames.append({"file_path": name, "transform_matrix": pose.tolist()})
    camera = {"w": 128, "h": 96, "fl_x": 100.0, "frames": frames} | lens
    (root / "transforms.json").write_text(json.dumps(camera))
    images = [{"id": k, "file_name": name, **size} for k, name in enumerate(photos)]
    rows = [
        {"id": k, "image_id": k, "category_id": 1, "segmentation": segmentation}
        for k in range(len(photos))
    ]
    labels = {"images": images, "annotations": rows, "categories": [{"id": 1, "name": "hold"}]}
    (root / "masks.json").write_text(json.dumps(labels))
    corners = [f"v {scale * x + shift} {scale * y} 0\n" for x, y in _PLATE]
    (root / "wall.obj").write_text("".join(corners) + "f 1 2 3 4\n")
    (root / "wall.gltf").write_text(json.dumps(_DRACO))
    return [
        "--mesh",
        str(root / mesh),
        "--cameras",
        str(root / "transforms.json"),
        "--masks",
        str(root / "masks.json"),
        "-o",
        str(root / "out"),
    ]


def _with(**changes: Any) -> Callable[[Path], list[str]]:
    return lambda root: _scene(root, **changes)


_TWO_FOLDERS = ("cam0/0.jpg", "cam1/0.jpg")

# Name of the input, its maker, and words of the message.
LIFT_CASES: tuple[tuple[str, Callable[[Path], list[str]], str], ...] = (
    (
        "lift: masks of photos that were turned by EXIF",
        _with(size={"width": 96, "height": 128}),
        "its masks are 96x128 pixels",
    ),
    (
        "lift: masks that fit the cameras of two folders",
        _with(cameras=_TWO_FOLDERS, photos=("0.jpg",)),
        "may belong to 2 cameras",
    ),
    (
        "lift: most photos of the masks without a camera",
        _with(photos=("0.jpg", "x.jpg", "y.jpg")),
        "2 of 3 photos of the masks have no camera",
    ),
    ("lift: masks without pixels", _with(segmentation=[]), "all 2 masks are empty"),
    (
        "lift: a mesh in millimetres, cameras in metres",
        _with(scale=1000.0, shift=3000.0),
        "a ratio of 1.41e+04",
    ),
    (
        "lift: a mesh in millimetres around the same origin",
        _with(scale=1000.0),
        "0 instances: the masks of different photos agree on no object",
    ),
    ("lift: a lens parameter `k5`", _with(k5=0.1), "k5 is not understood"),
    (
        "lift: a panoramic `camera_model`",
        _with(camera_model="EQUIRECTANGULAR"),
        "'EQUIRECTANGULAR' is not supported",
    ),
    (
        "lift: glTF compressed by Draco",
        _with(mesh="wall.gltf"),
        "requires the extension KHR_draco_mesh_compression",
    ),
)
