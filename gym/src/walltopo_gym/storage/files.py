"""The store of files by key, over obstore: a folder by default, S3 by a URL.

A file is there whole or not at all, and is never changed: keys name content, or one version of it.
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
from obstore.store import LocalStore, ObjectStore, from_url

from walltopo.core import SettingsError
from walltopo.core.files import atomic_path
from walltopo_gym.errors import NotFoundError
from walltopo_gym.settings import GymSettings

_LOG = logging.getLogger("walltopo_gym.storage")

_CHUNK: Final = 1 << 20


class FileStore:
    """Files by key, such as "photos/ab12...".

    Parameters
    ----------
    store : obstore's.
    """

    def __init__(self, store: ObjectStore) -> None:
        self._store = store

    def put(self, key: str, source: Path | bytes) -> None:
        """Keep a file under a key; what was there gives way."""
        obstore.put(self._store, key, source)

    def has(self, key: str) -> bool:
        """Whether there is such a file."""
        try:
            obstore.head(self._store, key)
        except FileNotFoundError:
            return False
        return True

    def read(self, key: str) -> bytes:
        """A small file whole.

        Raises
        ------
        NotFoundError : there is none.
        """
        return b"".join(self.chunks(key))

    def chunks(self, key: str) -> Iterator[bytes]:
        """A file piece by piece.

        Raises
        ------
        NotFoundError : there is none; before the first piece.
        """
        try:
            found = obstore.get(self._store, key)
        except FileNotFoundError as error:
            raise NotFoundError("this file is not there") from error
        return (bytes(piece) for piece in found.stream(min_chunk_size=_CHUNK))

    def fetch(self, key: str, path: Path) -> None:
        """Write a file to `path`, whole or not at all.

        Raises
        ------
        NotFoundError : there is none.
        """
        pieces = self.chunks(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary, temporary.open("wb") as out:
            for piece in pieces:
                out.write(piece)

    def keys(self, prefix: str) -> list[str]:
        """The keys below a prefix, sorted."""
        pages = obstore.list(self._store, prefix)
        return sorted(str(item["path"]) for page in pages for item in page)

    def entries(self, prefix: str) -> Iterator[tuple[str, int, datetime]]:
        """Key, bytes, and the moment of writing of each file below a prefix."""
        for page in obstore.list(self._store, prefix):
            for item in page:
                yield str(item["path"]), int(item["size"]), item["last_modified"]

    def drop(self, keys: list[str]) -> None:
        """Delete files; those that are gone already are passed over."""
        for key in keys:
            try:
                obstore.delete(self._store, key)
            except FileNotFoundError:
                continue


def open_store(settings: GymSettings) -> FileStore:
    """The store of the settings.

    Raises
    ------
    SettingsError : the URL is none that is understood.
    """
    if not settings.objects:
        return FileStore(LocalStore(settings.data / "files", mkdir=True))
    try:
        return FileStore(from_url(settings.objects))
    except Exception as error:  # obstore raises its own class for each kind of store
        raise SettingsError(f"objects: {settings.objects!r} cannot be used ({error})") from error


def private_folder(folder: Path) -> Path:
    """Return a folder that its owner alone can enter; made where it is not there.

    A gym's data folder has the database, photos with their places, and secrets.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if stat.S_IMODE(folder.stat().st_mode) & 0o077:
        try:
            folder.chmod(0o700)
        except PermissionError:  # another user's: whoever made it decides
            _LOG.warning("%s: other users of this machine can enter it (chmod 700 it)", folder)
    return folder


def hash_of_file(path: Path) -> str:
    """SHA-256 of a file's content, in hex digits."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
