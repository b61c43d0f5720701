"""What the process that decodes is asked, and what it answers; lines of JSON."""

from __future__ import annotations

from typing import TypeAlias

import msgspec

from walltopo.reconstruct.ingest.settings import IngestSettings


class Job(msgspec.Struct, frozen=True):
    """Decode these files.

    Parameters
    ----------
    files : paths as bytes, for not all are UTF-8, by number.
    folder : where the JPEGs go; each is called by its file's number.
    threads : how many files at a time.
    """

    files: dict[int, bytes]
    folder: bytes
    settings: IngestSettings
    threads: int


class Stored(msgspec.Struct, frozen=True):
    """A photo that was written.

    Parameters
    ----------
    file : its name in the folder.
    frame : number of the frame in a video.
    focal_px : in pixels of this file; None where unknown.
    thumbnail : `quality.thumbnail`, (64, 64) float32, as bytes.
    """

    file: str
    frame: int | None
    width: int
    height: int
    focal_px: float | None
    sharpness: float
    thumbnail: bytes


class Begun(msgspec.Struct, frozen=True, tag="begun"):
    """A file is being decoded: who dies after this died of it, or of another begun one."""

    number: int


class Done(msgspec.Struct, frozen=True, tag="done"):
    """What a file gave.

    Parameters
    ----------
    reasons : why it gave nothing, or not all.
    starved : memory ran out; alone it may go.
    """

    number: int
    photos: tuple[Stored, ...] = ()
    reasons: tuple[str, ...] = ()
    starved: bool = False


class Broken(msgspec.Struct, frozen=True, tag="broken"):
    """The machine lacks something (disk space): nothing can go on."""

    message: str
    hint: str


Answer: TypeAlias = Begun | Done | Broken
