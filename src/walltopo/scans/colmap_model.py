"""COLMAP models: the cameras, poses and points of `sparse/`, and a check of their binary files."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from walltopo.core import InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.core.files import check_name, move_into_place
from walltopo.core.text_files import read_utf8
from walltopo.scans.colmap_lens import camera_of
from walltopo.scans.document import check_once

if TYPE_CHECKING:
    from walltopo.geometry.colmap import pycolmap


@dataclass(frozen=True, eq=False)
class SparseModel:
    """A folder with a COLMAP model."""

    folder: Path

    @classmethod
    def load(cls, path: Path) -> SparseModel:
        """Return the model of a folder; raise InputError if it has none (see `open_model`)."""
        _check_model(path)
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    @cached_property
    def views(self) -> tuple[View, ...]:
        """Return the registered photos without masks, sorted by name."""
        return tuple(read_views(self.folder))

    def open(self) -> pycolmap.Reconstruction:
        """Return the model, read anew at each call, because COLMAP's functions modify it."""
        return open_model(self.folder)


def _check_model(path: Path) -> None:
    if not any((path / f"images{suffix}").is_file() for suffix in (".bin", ".txt")):
        raise InputError(
            f"{path}: not a COLMAP model (cameras, images and points3D as .bin or .txt)"
        )


def open_model(path: Path) -> pycolmap.Reconstruction:
    """Return the model in a folder.

    Raises
    ------
    InputError : the folder has no readable COLMAP model; or a photo's name points out of its
        folder, or its pose or camera is invalid.
    """
    from walltopo.geometry.colmap import pycolmap

    path = Path(path)
    _check_model(path)
    check_model_files(path)
    _check_text_names(path)
    try:
        with _readable_folder(path) as folder:
            model = pycolmap.Reconstruction(folder)
        with prefix_errors(path):
            _check_images(model)
    except (IndexError, MemoryError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: unreadable COLMAP model: {error}") from error
    return model


@contextmanager
def _readable_folder(folder: Path) -> Iterator[Path]:
    """Yield a folder of the model whose text COLMAP's own reader takes: UTF-8 without a mark."""
    texts = [path for path in sorted(folder.glob("*.txt")) if path.stem in _TEXTS]
    contents = {path.name: read_utf8(path) for path in texts}
    if all(contents[path.name] == path.read_bytes() for path in texts):
        yield folder
        return
    with TemporaryDirectory() as name:
        for file, content in contents.items():
            (Path(name) / file).write_bytes(content)
        yield Path(name)


_TEXTS = ("cameras", "images", "points3D", "rigs", "frames")


def _check_text_names(folder: Path) -> None:
    """Raise InputError if a text model has a photo whose name contains a space.

    COLMAP's own reader takes the first word for the name.
    """
    path = folder / "images.txt"
    if (folder / "images.bin").is_file() or not path.is_file():
        return
    lines = read_utf8(path).decode("utf-8", "replace").splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    for row in rows[::2]:  # every second line has the points of the photo above it
        words = row.split(maxsplit=9)
        if len(words) == 10 and " " in words[9].strip():
            raise InputError(
                f"{path}: the name {words[9].strip()!r} contains a space, which COLMAP's text "
                "models cannot express",
                "Rename the photo, or export the model in COLMAP's binary form.",
            )


def _check_images(model: pycolmap.Reconstruction) -> None:
    """Reject images with an invalid name, pose or camera."""
    names = [str(image.name) for image in model.images.values()]
    check_once("a photo named", names)
    for name in names:
        check_name(name)
    for image in model.images.values():
        if image.has_pose:
            view_of_image(image)


def view_of_image(image: pycolmap.Image) -> View:
    """Return a registered image as a `View` without masks."""
    pose = image.cam_from_world
    pose = pose() if callable(pose) else pose
    intrinsics = camera_of(image.camera)
    return View(str(image.name), intrinsics, np.asarray(pose.matrix(), dtype=np.float64))


def read_views(path: Path) -> list[View]:
    """Return the registered photos of a COLMAP model as views without masks, sorted by name.

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


class _Reader:
    """Steps through the bytes of a file; raises `_TruncatedError` if they end early."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def skip(self, size: int) -> None:
        self.at += size
        if self.at > len(self.data):
            raise _TruncatedError

    def number(self, kind: str) -> int:
        start = self.at
        self.skip(struct.calcsize(kind))
        value: int = struct.unpack_from("<" + kind, self.data, start)[0]
        return value

    def text(self) -> None:
        end = self.data.find(0, self.at)
        if end < 0:
            raise _TruncatedError
        self.at = end + 1


class _TruncatedError(Exception):
    """The file has fewer bytes than its counts require."""


def _camera(reader: _Reader) -> None:
    reader.skip(4)
    model = reader.number("i")
    if not 0 <= model < len(_PARAMETERS):
        raise InputError(f"camera model {model} is unknown")
    reader.skip(16 + 8 * _PARAMETERS[model])


def _image(reader: _Reader) -> None:
    reader.skip(4 + _POSE + 4)
    reader.text()
    reader.skip(reader.number("Q") * 24)


def _point(reader: _Reader) -> None:
    reader.skip(8 + 24 + 3 + 8)
    reader.skip(reader.number("Q") * 8)


def _rig(reader: _Reader) -> None:
    reader.skip(4)
    sensors = reader.number("I")
    if sensors:
        reader.skip(8)
    for _ in range(sensors - 1):
        reader.skip(8)
        if reader.number("B"):
            reader.skip(_POSE)


def _frame(reader: _Reader) -> None:
    reader.skip(8 + _POSE)
    reader.skip(reader.number("I") * 16)


_FILES: dict[str, Callable[[_Reader], None]] = {
    "cameras.bin": _camera,
    "images.bin": _image,
    "points3D.bin": _point,
    "rigs.bin": _rig,
    "frames.bin": _frame,
}


def check_model_files(folder: Path) -> None:
    """Check the structure of a model's binary files, of which some may be missing.

    Raises
    ------
    InputError : a file is shorter or longer than its counts require, or has an unknown camera
        model (the message names the file).
    """
    for name, entry in _FILES.items():
        path = folder / name
        if path.is_file():
            _check(path, entry)


def _check(path: Path, entry: Callable[[_Reader], None]) -> None:
    reader = _Reader(path.read_bytes())
    count = 0
    try:
        count = reader.number("Q")
        for _ in range(count):
            entry(reader)
    except _TruncatedError as error:
        raise InputError(
            f"{path}: truncated or damaged: {count} entries in {len(reader.data)} bytes",
            "Copy the model again, or run COLMAP again.",
        ) from error
    except InputError as error:
        raise InputError(f"{path}: {error.message}") from error
    if reader.at != len(reader.data):
        raise InputError(f"{path}: damaged: its {count} entries end at byte {reader.at}")
