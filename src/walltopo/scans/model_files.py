"""Whether a COLMAP model's binary files are as long as their counts say.

COLMAP believes these counts: a file that was cut asks it for unbounded memory, or lets it read
zeros for ever, or gives a smaller model in silence. Its text files it checks itself.
Format: COLMAP, "Output Format" (documentation) and `reconstruction_io_binary.cc`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

from walltopo.core import InputError

__all__ = ["check_model_files"]

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
