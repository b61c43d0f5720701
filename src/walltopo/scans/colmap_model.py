"""COLMAP models: the cameras, poses and points of `sparse/`, and a check of their binary files."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import naming
from walltopo.core.files import check_name, move_into_place
from walltopo.scans.document import check_once

if TYPE_CHECKING:
    from walltopo.geometry.colmap import pycolmap


@dataclass(frozen=True, eq=False)
class SparseModel:
    """A folder with a COLMAP model."""

    folder: Path

    @classmethod
    def load(cls, path: Path) -> SparseModel:
        """The folder; InputError where it holds no model (see `open_model`)."""
        _check_model(path)
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    @cached_property
    def views(self) -> tuple[View, ...]:
        """The registered photos without masks, sorted by name."""
        return tuple(read_views(self.folder))

    def open(self) -> pycolmap.Reconstruction:
        """The model, read anew at each call: COLMAP's functions change it in place."""
        return open_model(self.folder)


def _check_model(path: Path) -> None:
    if not any((path / f"images{suffix}").is_file() for suffix in (".bin", ".txt")):
        raise InputError(
            f"{path}: no COLMAP model here (cameras, images and points3D as .bin or .txt)"
        )


def open_model(path: Path) -> pycolmap.Reconstruction:
    """The model in a folder.

    Raises
    ------
    InputError : the folder holds no COLMAP model, or it cannot be read; a photo's name leads out
        of its folder, or its pose or camera is none.
    """
    from walltopo.geometry.colmap import pycolmap

    path = Path(path)
    _check_model(path)
    check_model_files(path)
    try:
        model = pycolmap.Reconstruction(path)
        with naming(path):
            _check_images(model)
    except (IndexError, MemoryError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: the COLMAP model cannot be read: {error}") from error
    return model


def _check_images(model: pycolmap.Reconstruction) -> None:
    """Refuse photos whose name, pose or camera is none."""
    names = [str(image.name) for image in model.images.values()]
    check_once("a photo called", names)
    for name in names:
        check_name(name)
    for image in model.images.values():
        if image.has_pose:
            view_of_image(image)


def view_of_image(image: pycolmap.Image) -> View:
    """A `View` without masks of a registered image."""
    camera = image.camera
    pose = image.cam_from_world
    pose = pose() if callable(pose) else pose
    intrinsics = Camera(
        camera.model.name,
        int(camera.width),
        int(camera.height),
        tuple(float(p) for p in camera.params),
    )
    return View(str(image.name), intrinsics, np.asarray(pose.matrix(), dtype=np.float64))


def read_views(path: Path) -> list[View]:
    """The registered photos of a COLMAP model as views without masks, sorted by name.

    Raises
    ------
    InputError : see `open_model`; or the model has no registered photo.
    """
    model = open_model(path)
    views = [view_of_image(image) for image in model.images.values() if image.has_pose]
    if not views:
        raise InputError(f"{path}: the COLMAP model has no registered photo")
    return sorted(views, key=lambda view: view.name)


# Parameters of each camera model, by COLMAP's model id.
_PARAMETERS = (3, 4, 4, 5, 8, 8, 12, 5, 4, 5, 12, 16, 4, 5, 3, 4, 6, 2)

_POSE = 7 * 8


class _Walk:
    """Goes through the bytes of a file; `_Cut` where they end early."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def skip(self, size: int) -> None:
        self.at += size
        if self.at > len(self.data):
            raise _Cut

    def number(self, kind: str) -> int:
        start = self.at
        self.skip(struct.calcsize(kind))
        value: int = struct.unpack_from("<" + kind, self.data, start)[0]
        return value

    def text(self) -> None:
        end = self.data.find(0, self.at)
        if end < 0:
            raise _Cut
        self.at = end + 1


class _Cut(Exception):  # noqa: N818
    """The file ends before what its counts promise."""


def _camera(walk: _Walk) -> None:
    walk.skip(4)
    model = walk.number("i")
    if not 0 <= model < len(_PARAMETERS):
        raise InputError(f"camera model {model} is unknown")
    walk.skip(16 + 8 * _PARAMETERS[model])


def _image(walk: _Walk) -> None:
    walk.skip(4 + _POSE + 4)
    walk.text()
    walk.skip(walk.number("Q") * 24)


def _point(walk: _Walk) -> None:
    walk.skip(8 + 24 + 3 + 8)
    walk.skip(walk.number("Q") * 8)


def _rig(walk: _Walk) -> None:
    walk.skip(4)
    sensors = walk.number("I")
    if sensors:
        walk.skip(8)
    for _ in range(sensors - 1):
        walk.skip(8)
        if walk.number("B"):
            walk.skip(_POSE)


def _frame(walk: _Walk) -> None:
    walk.skip(8 + _POSE)
    walk.skip(walk.number("I") * 16)


_FILES: dict[str, Callable[[_Walk], None]] = {
    "cameras.bin": _camera,
    "images.bin": _image,
    "points3D.bin": _point,
    "rigs.bin": _rig,
    "frames.bin": _frame,
}


def check_model_files(folder: Path) -> None:
    """Go through the binary files of a model that are there.

    Raises
    ------
    InputError : a file ends before or after what its counts say, or has an unknown camera model;
        names it.
    """
    for name, entry in _FILES.items():
        path = folder / name
        if path.is_file():
            _check(path, entry)


def _check(path: Path, entry: Callable[[_Walk], None]) -> None:
    walk = _Walk(path.read_bytes())
    count = 0
    try:
        count = walk.number("Q")
        for _ in range(count):
            entry(walk)
    except _Cut as error:
        raise InputError(
            f"{path}: is cut off or damaged: it promises {count} entries in {len(walk.data)} bytes",
            "Copy the model again, or run COLMAP again.",
        ) from error
    except InputError as error:
        raise InputError(f"{path}: {error.message}") from error
    if walk.at != len(walk.data):
        raise InputError(f"{path}: damaged: its {count} entries end at byte {walk.at} already")
