"""The files that the user means (folders, photos, videos), and their names in the scan."""

from __future__ import annotations

import errno
import os
import re
import stat
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from walltopo.core import InputError
from walltopo.core.files import as_text
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import SkippedFile
from walltopo.scans.sources import SourceFile, SourceList

PHOTO_SUFFIXES: Final = {".jpg", ".jpeg", ".png", ".heic", ".heif", ".webp", ".tif", ".tiff"}

VIDEO_SUFFIXES: Final = {".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm"}

_SPECIAL: Final = (
    (stat.S_ISFIFO, "a pipe, not a file"),
    (stat.S_ISSOCK, "a socket, not a file"),
    (stat.S_ISCHR, "a device, not a file"),
    (stat.S_ISBLK, "a device, not a file"),
)


@dataclass(frozen=True)
class Sources:
    """What the user gave.

    Parameters
    ----------
    files : photos and videos in natural order; all that ingest reads, and nothing else.
    skipped : what lies beside them, and why it is not read.
    """

    files: tuple[Path, ...]
    skipped: tuple[SkippedFile, ...]


def find_sources(given: Sequence[Path], own: Path | None = None) -> Sources:
    """The photos and videos among files and in folders; folders inside folders are left out.

    Parameters
    ----------
    own : the scan folder that is written; nothing in it is a source.

    Raises
    ------
    InputError : a path does not exist, is a scan folder or part of `own`, or nothing usable is
        there at all.
    """
    files: list[Path] = []
    skipped: list[SkippedFile] = []
    for path in given:
        _refuse_scans(path, own)
        for item in _items(path):
            reason = _reason_against(item)
            if reason:
                skipped.append(SkippedFile(shown_name(item), reason))
            else:
                files.append(item)
    if not files:
        names = ", ".join(str(path) for path in given)
        told = "\n".join(f"  {item.source}: {item.reason}" for item in skipped[:5])
        raise InputError(
            f"{names}: no photos here" + (f"\n{told}" if told else ""),
            "Give a folder of photos (JPEG, PNG, HEIC, WebP, TIFF), photo files, or a video.",
        )
    return Sources(tuple(dict.fromkeys(files)), tuple(skipped))


def list_sources(given: Sequence[Path], own: Path, content: Callable[[Path], str]) -> SourceList:
    """Return the sources with the hash of each; raises as `find_sources`.

    Parameters
    ----------
    content : hash of a file.
    """
    found = find_sources(given, own)
    files = [SourceFile(os.fsencode(file.absolute()), content(file)) for file in found.files]
    return SourceList(files=tuple(files), skipped=found.skipped)


def is_video(path: Path) -> bool:
    """Whether a source is read as a video, by its suffix."""
    return path.suffix.lower() in VIDEO_SUFFIXES


def shown_name(path: Path) -> str:
    """A file's name as text: bytes that are not UTF-8 are written out (`caf\\xe9.jpg`)."""
    return as_text(path.name)


def _refuse_scans(path: Path, own: Path | None) -> None:
    if not os.path.lexists(path):
        raise InputError(f"{path}: no such file or folder")
    if ScanFolder(path).manifest.is_file():
        raise InputError(
            f"{path}: is a scan folder, not a folder of photos",
            f"Its photos lie in {ScanFolder(path).photos}.",
        )
    # Path.resolve raises where a link leads in a circle.
    if own is not None and Path(os.path.realpath(own)) in Path(os.path.realpath(path)).parents:
        raise InputError(
            f"{path}: lies in the scan folder that is written ({own})",
            "Give the photos that the scan was made from, or another output folder.",
        )


def _items(path: Path) -> Iterator[Path]:
    """The path itself, or what a folder holds, without hidden things, in natural order."""
    if not path.is_dir():
        return iter([path])
    try:
        inside = [item for item in path.iterdir() if not item.name.startswith(".")]
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    return iter(sorted(inside, key=_natural))


def _reason_against(path: Path) -> str:
    """Why it is not read; empty for a photo or a video. Nothing is opened to find out."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        return _UNREACHABLE.get(error.errno or 0, f"cannot be read ({error.strerror})")
    if stat.S_ISDIR(mode):
        if ScanFolder(path).manifest.is_file():
            return "a scan folder"
        return "a folder; folders in the folder are not looked into"
    for is_special, reason in _SPECIAL:
        if is_special(mode):
            return reason
    known = path.suffix.lower() in PHOTO_SUFFIXES | VIDEO_SUFFIXES
    return "" if known else "neither a photo nor a video"


_UNREACHABLE: Final = {
    errno.ENOENT: "a link to nothing",
    errno.ELOOP: "a link that leads in a circle",
    errno.EACCES: "cannot be read (permission denied)",
}


def _natural(path: Path) -> list[tuple[int, int | str]]:
    """IMG_2 before IMG_10."""
    parts = re.split(r"(\d+)", path.name.lower())
    return [(0, int(part)) if part.isdecimal() else (1, part) for part in parts]


# File systems take 255 bytes; what stages and other programs add to a name needs some of them.
_MOST_BYTES: Final = 180


class Names:
    """Gives each name once, whatever the case of its letters."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def give(self, stem: str, end: str = "") -> str:
        """A name for a photo of this stem; `end` stays whole where the stem is cut."""
        stem = unicodedata.normalize("NFC", stem)
        # Bytes that were no UTF-8 stand as lone surrogates: no letters, so they become "_" too.
        stem = re.sub(r"[^\w.-]+", "_", stem).strip("._") or "photo"
        stem = stem.encode()[:_MOST_BYTES].decode("utf-8", "ignore") + end
        name, number = f"{stem}.jpg", 2
        while name.lower() in self._taken:
            name, number = f"{stem}_{number}.jpg", number + 1
        self._taken.add(name.lower())
        return name
