"""The user's files of a scan, and the photos that ingest made of them."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import as_text, check_name, move_into_place
from walltopo.images.files import read_grey, read_rgb
from walltopo.scans.document import Document, FileName, Side, read_document
from walltopo.scans.people import PEOPLE, Bitmap, PeopleList


class Photo(msgspec.Struct, frozen=True):
    """One photo of `photos/`.

    Parameters
    ----------
    name : file name in `photos/`; source : name of the source file.
    width, height : pixels.
    focal_px : focal length from EXIF, in pixels of this file, or None.
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
    """A source that gave no photo, with the reason."""

    source: str
    reason: str


class PhotoList(Document, frozen=True, kw_only=True):
    """`photos.json`."""

    photos: tuple[Photo, ...]
    skipped: tuple[SkippedFile, ...] = ()


@dataclass(frozen=True)
class PhotoSet:
    """A folder of photos, read one at a time, and where people stood in them."""

    folder: Path

    @classmethod
    def load(cls, path: Path) -> PhotoSet:
        """Return the set of a folder; raise InputError if the folder is missing."""
        if not path.is_dir():
            raise InputError(f"{path}: the folder of photos does not exist")
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    def path(self, name: str) -> Path:
        """Return the file of a photo.

        Raises
        ------
        InputError : the file is missing.
        """
        path = self.folder / name
        if not path.is_file():
            raise InputError(f"{path}: the photo is missing")
        return path

    def read_rgb(self, name: str) -> NDArray[np.uint8]:
        """Return a photo as (H, W, 3) uint8 sRGB; raise InputError if it is unreadable."""
        return read_rgb(self.path(name))

    @cached_property
    def people(self) -> PeopleList:
        """Return the photos that showed people, who are hidden in them.

        Raises
        ------
        InputError : the list is damaged.
        """
        path = self.folder / PEOPLE
        return PeopleList.load(path) if path.exists() else PeopleList()

    def people_mask(self, name: str, width: int = 0, height: int = 0) -> Bitmap | None:
        """Return the pixels of people in a photo, (height, width) bool; None without any.

        Parameters
        ----------
        width, height : size of the result, pixels; 0: the photo's own.

        Raises
        ------
        InputError : the list is damaged.
        """
        import cv2

        mask = self.people.mask(name)
        if mask is None or not width or mask.shape == (height, width):
            return mask
        resized = cv2.resize(mask.astype(np.uint8), (width, height), interpolation=cv2.INTER_AREA)
        return np.asarray(resized > 0)

    def read_grey(self, name: str) -> NDArray[np.uint8]:
        """Return a photo as (H, W) uint8 grey; raise InputError if it is unreadable."""
        return read_grey(self.path(name))


class SourceFile(msgspec.Struct, frozen=True):
    """A photo or video of the user.

    Parameters
    ----------
    path : absolute path as the bytes of the file system, which need not be UTF-8.
    content : hash of the file.
    """

    path: bytes
    content: str

    @property
    def file(self) -> Path:
        """Return the path of the file."""
        return Path(os.fsdecode(self.path))


class SourceList(Document, frozen=True, kw_only=True):
    """`sources.json`: the inputs of ingest in natural order, and the skipped files beside them."""

    files: tuple[SourceFile, ...]
    skipped: tuple[SkippedFile, ...] = ()

    @property
    def contents(self) -> list[tuple[str, str]]:
        """Return name and content hash of each file: a scan depends on these, not on folders."""
        return [(as_text(item.file.name), item.content) for item in self.files]

    @property
    def content_hash(self) -> str:
        """Return a hash of `contents`."""
        text = json.dumps(self.contents)
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    @classmethod
    def fingerprint(cls, path: Path) -> str:
        """Return the hash of a list's `contents`; "" without a list."""
        return read_document(path, cls).content_hash if path.exists() else ""

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the list.

        Raises
        ------
        InputError : the list is damaged, or one of its files is gone.
        """
        sources = super().load(path)
        gone = next((item.file for item in sources.files if not item.file.exists()), None)
        if gone is not None:
            raise InputError(
                f"{path.parent}: {gone} was deleted after the scan was made",
                "Give the photos again, or continue with the remaining ones by --accept-changes.",
            )
        return sources
