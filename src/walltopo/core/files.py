"""Files on disk: atomic writes, JSON, content hashes."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core.errors import EnvironmentLacksError, InputError

__all__ = [
    "atomic_path",
    "files_below",
    "hash_path",
    "move_into_place",
    "read_json",
    "told_when_full",
    "write_json",
]

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
def atomic_path(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; rename it over `path` when the block succeeds.

    Works for files and for folders (a folder replaces the old one). On an error or Ctrl-C
    nothing of the temporary remains and what was there before stays as it was.

    Raises
    ------
    EnvironmentLacksError : no space left, or the folder cannot be written.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        holder = Path(tempfile.mkdtemp(prefix=".partial-", dir=path.parent))
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {path.parent}: {error.strerror}") from error
    temporary = holder / path.name
    try:
        with told_when_full(path):
            yield temporary
            if temporary.is_dir() and path.exists():
                # A folder cannot be renamed over a full one: step the old one aside first.
                path.rename(holder / "old")
            temporary.replace(path)
    finally:
        shutil.rmtree(holder, ignore_errors=True)


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
