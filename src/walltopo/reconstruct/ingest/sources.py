"""Find the source files of a scan (folders, photos, videos) and name its photos."""

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
from walltopo.images.files import is_picture
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import SkippedFile, SourceFile, SourceList

PHOTO_SUFFIXES: Final = {
    ".jpg",
    ".jpeg",
    ".jfif",
    ".jpe",
    ".png",
    ".heic",
    ".heif",
    ".hif",
    ".avif",
    ".webp",
    ".tif",
    ".tiff",
    ".bmp",
}

VIDEO_SUFFIXES: Final = {".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm"}

_SPECIAL: Final = (
    (stat.S_ISFIFO, "a pipe, not a file"),
    (stat.S_ISSOCK, "a socket, not a file"),
    (stat.S_ISCHR, "a device, not a file"),
    (stat.S_ISBLK, "a device, not a file"),
)


@dataclass(frozen=True)
class Sources:
    """The sources of a scan.

    Parameters
    ----------
    files : photos and videos in natural order; ingest reads exactly these.
    skipped : other files beside them, and why they are not read.
    """

    files: tuple[Path, ...]
    skipped: tuple[SkippedFile, ...]


def find_sources(given: Sequence[Path], own: Path | None = None) -> Sources:
    """Return the photos and videos among files and in folders, without subfolders.

    Parameters
    ----------
    given : paths of the user.
    own : scan folder to write; files inside it are not accepted as sources.

    Raises
    ------
    InputError : a path does not exist, is a scan folder or lies in `own`, or no file is usable.
    """
    files: list[Path] = []
    skipped: list[SkippedFile] = []
    for path in given:
        _check_path(path, own)
        for item in _visible_items(path):
            reason = _skip_reason(item)
            if reason:
                skipped.append(SkippedFile(shown_name(item), reason))
            else:
                files.append(item)
    if not files:
        names = ", ".join(str(path) for path in given)
        reasons = "\n".join(f"  {item.source}: {item.reason}" for item in skipped[:5])
        raise InputError(
            f"{names}: no photos here" + (f"\n{reasons}" if reasons else ""),
            "Give a folder of photos (JPEG, PNG, HEIC, WebP, TIFF), photo files, or a video.",
        )
    return Sources(tuple(dict.fromkeys(files)), tuple(skipped))


def list_sources(given: Sequence[Path], own: Path, content: Callable[[Path], str]) -> SourceList:
    """Return the sources with a hash of each file; raise the errors of `find_sources`.

    Parameters
    ----------
    content : function that hashes a file.
    """
    found = find_sources(given, own)
    files = [SourceFile(os.fsencode(file.absolute()), content(file)) for file in found.files]
    return SourceList(files=tuple(files), skipped=found.skipped)


def is_video(path: Path) -> bool:
    """Return whether a source is a video, by its suffix."""
    return path.suffix.lower() in VIDEO_SUFFIXES


def still_of(video: Path) -> Path | None:
    """Return a photo of the same name beside a video, as a Live Photo has one; else None."""
    for item in sorted(video.parent.iterdir()):
        same = item.stem.lower() == video.stem.lower()
        if same and item.suffix.lower() in PHOTO_SUFFIXES:
            return item
    return None


def shown_name(path: Path) -> str:
    """Return a file's name as text; escape bytes that are not UTF-8 (`caf\\xe9.jpg`)."""
    return as_text(path.name)


def _check_path(path: Path, own: Path | None) -> None:
    """Raise InputError if a path is missing, is a scan folder or lies in the folder `own`."""
    if not os.path.lexists(path):
        raise InputError(f"{path}: no such file or folder")
    if ScanFolder(path).manifest.is_file():
        raise InputError(
            f"{path}: is a scan folder, not a folder of photos",
            f"Its photos lie in {ScanFolder(path).photos}.",
        )
    # Path.resolve would raise for a circular link.
    if own is not None and Path(os.path.realpath(own)) in Path(os.path.realpath(path)).parents:
        raise InputError(
            f"{path}: lies in the scan folder that is written ({own})",
            "Give the photos that the scan was made from, or another output folder.",
        )


def _visible_items(path: Path) -> Iterator[Path]:
    """Yield the path itself, or the visible items of a folder in natural order."""
    if not path.is_dir():
        return iter([path])
    try:
        inside = [item for item in path.iterdir() if not item.name.startswith(".")]
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    return iter(sorted(inside, key=_natural_key))


def _skip_reason(path: Path) -> str:
    """Return why a path is skipped, or "" for a photo or a video.

    A file of a known suffix is not opened; of another one, the first bytes decide.
    """
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
    if path.suffix.lower() in PHOTO_SUFFIXES | VIDEO_SUFFIXES:
        return ""
    return _kind_by_content(path)


# Offsets and signatures of archives.
_ARCHIVES: Final = (
    (0, b"PK\x03\x04"),
    (0, b"7z\xbc\xaf\x27\x1c"),
    (0, b"Rar!"),
    (0, b"\x1f\x8b"),
    (257, b"ustar"),
)


def _kind_by_content(path: Path) -> str:
    """Return why a file of an unknown suffix is skipped, "" for a photo, by its first bytes."""
    try:
        with path.open("rb") as stream:
            head = stream.read(512)
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    if is_picture(head):
        return ""
    if any(head[at:].startswith(sign) for at, sign in _ARCHIVES):
        return "an archive; unpack it and give its folder"
    return "neither a photo nor a video"


_UNREACHABLE: Final = {
    errno.ENOENT: "a link to nothing",
    errno.ELOOP: "a link that leads in a circle",
    errno.EACCES: "cannot be read (permission denied)",
}


def _natural_key(path: Path) -> list[tuple[int, int | str]]:
    """Return a sort key that puts IMG_2 before IMG_10."""
    parts = re.split(r"(\d+)", path.name.lower())
    return [(0, int(part)) if part.isdecimal() else (1, part) for part in parts]


# File systems limit a name to 255 bytes; the rest is for suffixes that stages and tools add.
_MAX_BYTES: Final = 180


class Names:
    """Assigns unique file names, ignoring case."""

    def __init__(self) -> None:
        self._used: set[str] = set()

    def assign(self, stem: str, end: str = "") -> str:
        """Return a name for a photo of this stem; a long stem is cut, `end` is kept whole."""
        stem = unicodedata.normalize("NFC", stem)
        # Non-UTF-8 bytes are lone surrogates, which are not letters, so they become "_" too.
        stem = re.sub(r"[^\w.-]+", "_", stem).strip("._") or "photo"
        stem = stem.encode()[:_MAX_BYTES].decode("utf-8", "ignore") + end
        name, number = f"{stem}.jpg", 2
        while name.lower() in self._used:
            name, number = f"{stem}_{number}.jpg", number + 1
        self._used.add(name.lower())
        return name
