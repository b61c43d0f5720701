"""Files on disk: atomic writes, JSON, content hashes, and names that must stay in their folder."""

from __future__ import annotations

import hashlib
import json
import ntpath
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

import msgspec

from walltopo.core.errors import EnvironmentLacksError, InputError

# What a desktop leaves in a folder that it shows.
_CLUTTER = frozenset({"Thumbs.db", "desktop.ini"})


@contextmanager
def told_when_full(path: Path) -> Iterator[None]:
    """Raise `EnvironmentLacksError` naming `path` where the disk is full in the block."""
    try:
        yield
    except OSError as error:
        if error.errno in (28, 122):  # ENOSPC, EDQUOT
            raise EnvironmentLacksError(
                f"no space left while writing {path}", "Free some disk space and run again."
            ) from error
        raise


@contextmanager
def scratch_beside(folder: Path) -> Iterator[Path]:
    """A temporary folder within `folder`, so that what is made there moves by a rename.

    Raises
    ------
    EnvironmentLacksError : `folder` cannot be made or written, or no space is left.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        holder = Path(tempfile.mkdtemp(prefix=".partial-", dir=folder))
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {folder}: {error.strerror}") from error
    try:
        with told_when_full(folder):
            yield holder
    finally:
        shutil.rmtree(holder, ignore_errors=True)


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; rename it over `path` when the block succeeds.

    Works for files and for folders (a folder replaces the old one). On an error or Ctrl-C
    nothing of the temporary remains and what was there before stays as it was. A symbolic link
    is replaced itself; what it leads to stays.

    Raises
    ------
    InputError : a device, a pipe or a socket is there, or a folder where a file is to be, or a
        file where a folder is to be.
    EnvironmentLacksError : no space left, or the folder cannot be written.
    """
    path = Path(path)
    _refuse_special(path)
    with told_when_full(path), scratch_beside(path.parent) as holder:
        temporary = holder / path.name
        yield temporary
        _refuse_special(path)
        if temporary.is_dir() and path.is_file():
            raise InputError(f"{path}: is a file, expected a folder")
        if not temporary.is_dir() and path.is_dir() and not path.is_symlink():
            raise InputError(f"{path}: is a folder, expected a file")
        if temporary.is_dir() and path.exists():
            # A folder cannot be renamed over a full one: step the old one aside first.
            path.rename(holder / "old")
        temporary.replace(path)


def is_special(path: Path) -> bool:
    """Whether a device, a pipe or a socket is there: nothing that a file may replace."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode) or stat.S_ISLNK(mode))


def _refuse_special(path: Path) -> None:
    if is_special(path):
        raise InputError(f"{path}: is a device, a pipe or a socket; no file can replace it")


def write_json(path: Path, value: Any) -> None:
    """Write `value` as JSON, atomically; NaN is refused because JSON has none."""
    with atomic_path(path) as temporary:
        text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> Any:
    """Read JSON; strictly: no NaN, no number beyond a double, no half of a surrogate pair.

    Raises
    ------
    InputError : the file is missing, cannot be read or is not JSON; names the file.
    """
    try:
        return msgspec.json.decode(Path(path).read_bytes())
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid JSON ({error})") from error


def hash_path(path: Path) -> str:
    """Content hash of a file, or of `files_below` a folder (names included); '' if absent."""
    path = Path(path)
    digest = hashlib.blake2b(digest_size=16)
    if path.is_file():
        with path.open("rb") as stream:
            while chunk := stream.read(1 << 20):
                digest.update(chunk)
    elif path.is_dir():
        for item in files_below(path):
            digest.update(os.fsencode(str(item.relative_to(path))))
            digest.update(hash_path(item).encode())
    else:
        return ""
    return digest.hexdigest()


def as_text(path: Path | str) -> str:
    """A path as text that any file can hold: bytes that are not UTF-8 are written out (`\\xe9`)."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


def files_below(folder: Path) -> list[Path]:
    """All files of a folder, sorted; without hidden ones and what desktops leave behind."""
    return sorted(_walk(folder))


def _walk(folder: Path) -> Iterator[Path]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(".") or entry.name in _CLUTTER:
                continue
            if entry.is_dir(follow_symlinks=False):
                yield from _walk(Path(entry.path))
            elif entry.is_file():
                yield Path(entry.path)


def move_into_place(made: Path, path: Path) -> None:
    """Let `path` be what lies at `made` (on the same disk); what was there goes; atomic."""
    with atomic_path(path) as temporary:
        made.rename(temporary)


def check_name(name: str) -> str:
    """A relative name such as `a.jpg` or `cam1/a.jpg`, as it was given.

    Raises
    ------
    InputError : it is empty, absolute (also by Windows' rules), has `..` in it, or a character
        that no file name has.
    """
    parts = PurePosixPath(name.replace("\\", "/")).parts
    if not parts:
        raise InputError("a file without a name")
    if name.startswith(("/", "\\")) or ntpath.splitdrive(name)[0] or ".." in parts:
        raise InputError(f"{name!r} leads out of its folder; expected a relative name without ..")
    if any(ord(letter) < 32 or ord(letter) == 127 for letter in name) or _no_text(name):
        raise InputError(f"{name!r} is no file name: it has a control character")
    if max(len(part.encode()) for part in parts) > 255:
        raise InputError(f"{name[:40]!r}... is no file name: it is longer than 255 bytes")
    return name


def _no_text(name: str) -> bool:
    """Whether a half of a surrogate pair is in it."""
    return any(0xD800 <= ord(letter) < 0xE000 for letter in name)


def join_inside(root: Path, name: str) -> Path:
    """`root / name` for a name that a data file gave: every such path is made here.

    A link within `root` that leads out of it is followed for the file itself (folders of links to
    photos are common, and renaming over a link replaces the link), never for a folder on the way.

    Raises
    ------
    InputError : see `check_name`; or a folder on the way is a link that leads out of `root`.
    """
    path = root / check_name(name)
    if not path.parent.resolve().is_relative_to(root.resolve()):
        raise InputError(f"{name!r} leads out of {root} by a link")
    return path


def shipped_file(name: str) -> Path:
    """Return the path of a model that comes with walltopo."""
    return Path(__file__).parents[1] / "models" / name
