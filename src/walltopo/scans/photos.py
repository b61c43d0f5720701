"""`photos/` and `photos.json`: the upright JPEGs that every stage after ingest reads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import check_name, move_into_place
from walltopo.images.files import read_grey, read_rgb
from walltopo.scans.document import Document, FileName, Side


class Photo(msgspec.Struct, frozen=True):
    """One photo of `photos/`.

    Parameters
    ----------
    name : file name in `photos/`; source : of the file it was made from.
    width, height : pixels.
    focal_px : focal length told by EXIF, in pixels of this file; None where it tells none.
    sharpness : variance of the Laplacian at 1024 px.
    """

    name: FileName
    width: Side
    height: Side
    focal_px: float | None
    source: str
    sharpness: float

    def __post_init__(self) -> None:
        check_name(self.name)


class SkippedFile(msgspec.Struct, frozen=True):
    """A source that gave no photo, and why."""

    source: str
    reason: str


class PhotoList(Document, frozen=True, kw_only=True):
    """`photos.json`."""

    photos: tuple[Photo, ...]
    skipped: tuple[SkippedFile, ...] = ()


@dataclass(frozen=True)
class PhotoSet:
    """A folder of photos, read one at a time."""

    folder: Path

    @classmethod
    def load(cls, path: Path) -> PhotoSet:
        """The folder; InputError where it is missing."""
        if not path.is_dir():
            raise InputError(f"{path}: no such folder of photos")
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    def path(self, name: str) -> Path:
        """The file of a photo.

        Raises
        ------
        InputError : it is missing.
        """
        path = self.folder / name
        if not path.is_file():
            raise InputError(f"{path}: the photo is missing")
        return path

    def read_rgb(self, name: str) -> NDArray[np.uint8]:
        """A photo as (H, W, 3) uint8 sRGB; InputError where it cannot be read."""
        return read_rgb(self.path(name))

    def read_grey(self, name: str) -> NDArray[np.uint8]:
        """A photo as (H, W) uint8 grey; InputError where it cannot be read."""
        return read_grey(self.path(name))
