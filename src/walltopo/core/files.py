"""Read and write files: atomic writes, bounded reads of JSON and TOML, content hashes."""

from __future__ import annotations

import hashlib
import json
import ntpath
import os
import shutil
import stat
import tempfile
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

import msgspec

from walltopo.core.errors import EnvironmentLacksError, InputError, prefix_errors
from walltopo.core.text_files import as_utf8, read_utf8

# Files that desktop environments create in folders.
_DESKTOP_FILES = frozenset({"Thumbs.db", "desktop.ini"})


@contextmanager
def explain_full_disk(path: Path) -> Iterator[None]:
    """Raise EnvironmentLacksError that names `path` if the disk is full in the block."""
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
    """Yield a temporary folder within `folder`, so that results can be moved by a rename.

    Raises
    ------
    EnvironmentLacksError : `folder` cannot be created or written, or the disk is full.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        holder = Path(tempfile.mkdtemp(prefix=".partial-", dir=folder))
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {folder}: {error.strerror}") from error
    try:
        with explain_full_disk(folder):
            yield holder
    finally:
        shutil.rmtree(holder, ignore_errors=True)


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it to `path` if the block succeeds.

    The path may be a file or a folder (a folder replaces the old one). On an error or Ctrl-C the
    temporary path is removed and `path` is unchanged. A symbolic link is replaced; its target
    stays.

    Raises
    ------
    InputError : `path` is a device, pipe or socket, a folder instead of a file, or a file instead
        of a folder.
    EnvironmentLacksError : the disk is full, or the folder cannot be written.
    """
    path = Path(path)
    _check_not_special(path)
    with explain_full_disk(path), scratch_beside(path.parent) as holder:
        temporary = holder / path.name
        yield temporary
        _check_not_special(path)
        if temporary.is_dir() and path.is_file():
            raise InputError(f"{path}: is a file, expected a folder")
        if not temporary.is_dir() and path.is_dir() and not path.is_symlink():
            raise InputError(f"{path}: is a folder, expected a file")
        if temporary.is_dir() and path.exists():
            # A folder cannot be renamed over a non-empty one, so move the old one away first.
            path.rename(holder / "old")
        temporary.replace(path)


def is_special(path: Path) -> bool:
    """Return whether the path is a device, pipe or socket, which no file may replace."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode) or stat.S_ISLNK(mode))


def _check_not_special(path: Path) -> None:
    if is_special(path):
        raise InputError(f"{path}: is a device, a pipe or a socket; no file can replace it")


def write_json(path: Path, value: Any) -> None:
    """Write `value` as JSON, atomically; raise ValueError for NaN, which JSON lacks."""
    with atomic_path(path) as temporary:
        text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> Any:
    """Read JSON strictly: no NaN, no number beyond a double, no unpaired surrogate.

    Raises
    ------
    InputError : the file is missing, unreadable or not JSON; the message names the file.
    """
    content = read_utf8(path)
    try:
        return msgspec.json.decode(content)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid JSON ({error})") from error


def hash_path(path: Path) -> str:
    """Return a content hash of a file or of a folder's files with their names; "" if absent."""
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
    """Return a path as valid text; escape bytes that are not UTF-8 (`\\xe9`)."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


def files_below(folder: Path) -> list[Path]:
    """Return all files below a folder, sorted, without hidden files and desktop files."""
    return sorted(_walk(folder))


def _walk(folder: Path) -> Iterator[Path]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(".") or entry.name in _DESKTOP_FILES:
                continue
            if entry.is_dir(follow_symlinks=False):
                yield from _walk(Path(entry.path))
            elif entry.is_file():
                yield Path(entry.path)


def move_into_place(source: Path, path: Path) -> None:
    """Move `source` to `path` on the same disk, atomically; an existing `path` is replaced."""
    with atomic_path(path) as temporary:
        source.rename(temporary)


def check_name(name: str) -> str:
    """Return a relative name such as `a.jpg` or `cam1/a.jpg` unchanged, if it is safe.

    Raises
    ------
    InputError : the name is empty, absolute (also by Windows' rules), too long, or contains `..` or
        a control character.
    """
    parts = PurePosixPath(name.replace("\\", "/")).parts
    if not parts:
        raise InputError("a file without a name")
    if name.startswith(("/", "\\")) or ntpath.splitdrive(name)[0] or ".." in parts:
        raise InputError(f"{name!r} leads out of its folder; expected a relative name without ..")
    if any(ord(letter) < 32 or ord(letter) == 127 for letter in name) or _has_surrogate(name):
        raise InputError(f"{name!r} is not a file name: it has a control character")
    if max(len(part.encode()) for part in parts) > 255:
        raise InputError(f"{name[:40]!r}... is not a file name: it is longer than 255 bytes")
    return name


def _has_surrogate(name: str) -> bool:
    """Return whether the name has an unpaired surrogate."""
    return any(0xD800 <= ord(letter) < 0xE000 for letter in name)


def join_inside(root: Path, name: str) -> Path:
    """Return `root / name` for a name from a data file; build all such paths with this function.

    The file itself may be a link that leads out of `root`: folders of links to photos are common,
    and renaming over a link replaces the link. A parent folder may not.

    Raises
    ------
    InputError : see `check_name`; or a parent folder is a link that leads out of `root`.
    """
    path = root / check_name(name)
    if not path.parent.resolve().is_relative_to(root.resolve()):
        raise InputError(f"{name!r} leads out of {root} by a link")
    return path


def shipped_file(name: str) -> Path:
    """Return the path of a model that is part of walltopo."""
    return Path(__file__).parents[1] / "models" / name


_MAX_BYTES = 4 << 20  # tomllib takes quadratic time on some files

_MAX_DEPTH = 32


def read_toml(path: Path, hint: str = "") -> dict[str, Any]:
    """Return the table of a TOML file.

    Parameters
    ----------
    hint : hint of the error if the file is missing.

    Raises
    ------
    InputError : the file is missing, unreadable, not TOML, too large or nested too deeply; the
        message names the file.
    """
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(_MAX_BYTES + 1)
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file", hint) from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    if len(content) > _MAX_BYTES:
        raise InputError(f"{path}: larger than {_MAX_BYTES >> 20} MB, not a TOML of walltopo")
    try:
        with prefix_errors(path):
            content = as_utf8(content)
        table = tomllib.loads(content.decode())
    except RecursionError as error:
        raise InputError(f"{path}: not valid TOML (nested too deeply)") from error
    except ValueError as error:  # TOMLDecodeError, UnicodeDecodeError, a number of 5,000 digits
        raise InputError(f"{path}: not valid TOML ({error})") from error
    if deeper_than(_MAX_DEPTH, table):
        raise InputError(f"{path}: not valid TOML (nested too deeply)")
    return table


def deeper_than(max_depth: int, value: Any) -> bool:
    """Return whether lists and dicts are nested more than `max_depth` deep; without recursion."""
    level: list[Any] = [value]
    for _ in range(max_depth + 1):
        level = [item for outer in level for item in _items(outer)]
        if not level:
            return False
    return True


def _items(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, (list, tuple)) else ()


_SAMPLE_BYTES = 4096  # bytes of both ends of a file in its stamp

_Entries = dict[str, tuple[str, str]]


class HashCache:
    """A cache of the content hashes of files and folders.

    Parameters
    ----------
    path : file of the cache between runs; an unreadable file counts as empty.
    trust : whether a file with an unchanged stamp (size, times, both ends) is taken as unchanged;
        otherwise every file is read once.
    """

    def __init__(self, path: Path, *, trust: bool = True) -> None:
        self._path, self._trust = path, trust
        self._known = _read(path)
        self._used: set[str] = set()  # keys of this run; others are dropped on save

    def hash(self, path: Path) -> str:
        """Return the content hash of a file, or of a folder's files with their names; "" if
        absent."""
        key, now = as_text(path.absolute()), file_digest(path)
        known = self._known.get(key)
        if known is None or known[0] != now or not (self._trust or key in self._used):
            known = self._known[key] = (now, hash_path(path))
        self._used.add(key)
        return known[1]

    def save(self) -> None:
        """Write the hashes that this run used."""
        write_json(self._path, {key: self._known[key] for key in sorted(self._used)})


def _read(path: Path) -> _Entries:
    try:
        return msgspec.convert(read_json(path), _Entries)
    except (InputError, msgspec.ValidationError):
        return {}


def file_digest(path: Path) -> str:
    """Return a digest of sizes, times and both ends of files, which changes if the content
    changes."""
    digest = hashlib.blake2b(digest_size=16)
    for file in files_below(path) if path.is_dir() else [path] if path.is_file() else []:
        facts = file.stat()
        digest.update(os.fsencode(file.relative_to(path)) + b"\0")
        digest.update(f"{facts.st_size} {facts.st_mtime_ns} {facts.st_ctime_ns}\0".encode())
        with file.open("rb") as stream:
            digest.update(stream.read(_SAMPLE_BYTES))
            stream.seek(max(facts.st_size - _SAMPLE_BYTES, 0))
            digest.update(stream.read(_SAMPLE_BYTES))
    return digest.hexdigest()
