"""`photos.json`: the photos that later stages read, and what ingest left out."""

from __future__ import annotations

import msgspec

from walltopo.core.inside import check_name
from walltopo.scans.bounds import FileName, Side
from walltopo.scans.document import Document

__all__ = ["Photo", "PhotoList", "SkippedFile"]


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
