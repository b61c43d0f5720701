"""The store of files by key, over obstore: a folder by default, S3 by a URL.

A file is stored whole or not at all and never changes: its key names its content or one version.
"""

from __future__ import annotations

import hashlib
import logging
import stat
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Final

import obstore
from obstore.store import LocalStore, ObjectStore

from walltopo.core import InputError, SettingsError
from walltopo.scans import object_store
from walltopo.scans.object_store import fetch_file
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.errors import NotFoundError
from walltopo_gym.settings import GymSettings

_LOG = logging.getLogger("walltopo_gym.storage")

_CHUNK: Final = 1 << 20
_WORK: Final = "the store of files is used"


class FileStore:
    """Files by key, such as "photos/ab12...".

    Parameters
    ----------
    objects : obstore's store.
    """

    def __init__(self, objects: ObjectStore) -> None:
        self.objects = objects

    def put(self, key: str, source: Path | bytes) -> None:
        """Store a file under a key, replacing an existing one."""
        check_unlocked(_WORK)
        obstore.put(self.objects, key, source)

    def has(self, key: str) -> bool:
        """Return whether a file exists."""
        check_unlocked(_WORK)
        try:
            obstore.head(self.objects, key)
        except FileNotFoundError:
            return False
        return True

    def read(self, key: str) -> bytes:
        """Return the content of a small file.

        Raises
        ------
        NotFoundError : there is no such file.
        """
        return b"".join(self.chunks(key))

    def chunks(self, key: str) -> Iterator[bytes]:
        """Yield the content of a file in pieces.

        Raises
        ------
        NotFoundError : there is no such file; raised before the first piece.
        """
        check_unlocked(_WORK)
        try:
            found = obstore.get(self.objects, key)
        except FileNotFoundError as error:
            raise NotFoundError("file-gone") from error
        return (bytes(piece) for piece in found.stream(min_chunk_size=_CHUNK))

    def part(self, key: str, begin: int, end: int) -> Iterator[bytes]:
        """Yield the bytes of a file from `begin` to before `end` in pieces.

        Raises
        ------
        NotFoundError : there is no such file; raised before the first piece.
        """
        if not self.has(key):
            raise NotFoundError("file-gone")
        starts = range(begin, end, _CHUNK)
        return (
            bytes(obstore.get_range(self.objects, key, start=at, end=min(at + _CHUNK, end)))
            for at in starts
        )

    def fetch(self, key: str, path: Path) -> None:
        """Write a file to `path`, whole or not at all.

        Raises
        ------
        NotFoundError : there is no such file.
        """
        check_unlocked(_WORK)
        try:
            fetch_file(self.objects, key, path)
        except FileNotFoundError as error:
            raise NotFoundError("file-gone") from error

    def copy_below(self, prefix: str, target: str) -> None:
        """Copy all files below a prefix to another one; in a folder, copies share their bytes."""
        check_unlocked(_WORK)
        for key in self.keys(prefix):
            obstore.copy(self.objects, key, target + key.removeprefix(prefix))

    def keys(self, prefix: str) -> list[str]:
        """Return the keys below a prefix, sorted."""
        check_unlocked(_WORK)
        pages = obstore.list(self.objects, prefix)
        return sorted(str(item["path"]) for page in pages for item in page)

    def entries(self, prefix: str) -> Iterator[tuple[str, int, datetime]]:
        """Return key, size in bytes and modification time of each file below a prefix."""
        check_unlocked(_WORK)
        for page in obstore.list(self.objects, prefix):
            for item in page:
                yield str(item["path"]), int(item["size"]), item["last_modified"]

    def top_entries(self) -> Iterator[tuple[str, int, datetime]]:
        """Return the same of the files in no folder; no folder is entered."""
        check_unlocked(_WORK)
        for item in obstore.list_with_delimiter(self.objects)["objects"]:
            yield str(item["path"]), int(item["size"]), item["last_modified"]

    def drop(self, keys: list[str]) -> None:
        """Delete files; missing ones are ignored."""
        check_unlocked(_WORK)
        for key in keys:
            try:
                obstore.delete(self.objects, key)
            except FileNotFoundError:
                continue


def open_store(settings: GymSettings) -> FileStore:
    """Return the store of the settings.

    Raises
    ------
    SettingsError : the URL is not supported.
    """
    if not settings.objects:
        return FileStore(LocalStore(settings.data / "files", mkdir=True))
    try:
        return FileStore(object_store.open_store(settings.objects))
    except InputError as error:
        raise SettingsError(f"objects: {error.message}") from error


def private_folder(folder: Path) -> Path:
    """Return a folder that only its owner can enter; create it if it is missing.

    A gym's data folder has the database, photos with their locations, and secrets.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if stat.S_IMODE(folder.stat().st_mode) & 0o077:
        try:
            folder.chmod(0o700)
        except PermissionError:  # another user's folder: its owner decides
            _LOG.warning("%s: other users of this machine can enter it (chmod 700 it)", folder)
    return folder


def hash_of_file(path: Path) -> str:
    """Return the SHA-256 of a file's content in hex digits."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
