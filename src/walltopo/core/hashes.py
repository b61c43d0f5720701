"""Content hashes, remembered while nothing about a file changed: what a rerun need not read again.

`work/hashes.json` is a cache as git's index is: without it everything is read once more.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import msgspec

from walltopo.core import InputError
from walltopo.core.files import as_text, files_below, hash_path, read_json, write_json

_ENDS = 4096  # bytes looked at, at both ends of a file

_Entries = dict[str, tuple[str, str]]


class Ledger:
    """The content hash of files and folders.

    Parameters
    ----------
    path : where the ledger is kept between runs; what is unreadable there counts as nothing.
    trust : whether a file that looks as it did (its size, times and both ends) is taken to be as
        it was; without, everything is read.
    """

    def __init__(self, path: Path, *, trust: bool = True) -> None:
        self._path, self._trust = path, trust
        self._known = _read(path)
        self._used: set[str] = set()  # in this run; what no run asks for is forgotten

    def hash(self, path: Path) -> str:
        """Content hash of a file, or of all files in a folder (names included); '' if absent."""
        key, now = as_text(path.absolute()), stamp(path)
        known = self._known.get(key)
        if known is None or known[0] != now or not (self._trust or key in self._used):
            known = self._known[key] = (now, hash_path(path))
        self._used.add(key)
        return known[1]

    def save(self) -> None:
        """Keep what was found for the next run."""
        write_json(self._path, {key: self._known[key] for key in sorted(self._used)})


def _read(path: Path) -> _Entries:
    try:
        return msgspec.convert(read_json(path), _Entries)
    except (InputError, msgspec.ValidationError):
        return {}


def stamp(path: Path) -> str:
    """What can be told of a file or folder without reading it whole."""
    digest = hashlib.blake2b(digest_size=16)
    for file in files_below(path) if path.is_dir() else [path] if path.is_file() else []:
        facts = file.stat()
        digest.update(os.fsencode(file.relative_to(path)) + b"\0")
        digest.update(f"{facts.st_size} {facts.st_mtime_ns} {facts.st_ctime_ns}\0".encode())
        with file.open("rb") as stream:
            digest.update(stream.read(_ENDS))
            stream.seek(max(facts.st_size - _ENDS, 0))
            digest.update(stream.read(_ENDS))
    return digest.hexdigest()
