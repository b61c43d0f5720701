"""Partly uploaded files in the data folder.

The file's length on disk is the only record of the offset: a killed server has what it has written,
and reports exactly that.
"""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import IO, Final, Literal
from uuid import UUID

from walltopo.core.locks import take_lock
from walltopo_gym.errors import ConflictError, UnavailableError

Fullness = Literal["ok", "nearly full", "full"]

_MB = 1_000_000
_HELD_S = 3600
_LAST_PART = 10  # with a tenth of what is kept free the database itself is about to stop
_NO_OTHERS: Mapping[UUID, int] = MappingProxyType({})
_PHOTO = re.compile(r"[0-9a-f]{32}")
LONGEST_PHOTO: Final = 2_000_000_000  # what can be announced at most, by the settings


class Incoming:
    """The folder of partly uploaded files.

    Parameters
    ----------
    folder : created if it is missing.
    keep_free_mb : uploads are refused if the disk has less left.
    copied : whether complete files are copied to a store on the same disk.
    """

    def __init__(self, folder: Path, keep_free_mb: int, *, copied: bool = True) -> None:
        self._folder, self._keep_free, self._copied = folder, keep_free_mb * _MB, copied
        folder.mkdir(parents=True, exist_ok=True)

    def beside(self, name: str) -> Incoming:
        """Return a folder for other files beside this one, with the same limits."""
        folder = self._folder.with_name(f"{self._folder.name}-{name}")
        return Incoming(folder, self._keep_free // _MB, copied=self._copied)

    def path(self, photo: UUID) -> Path:
        """Return the path of a photo's file."""
        return self._folder / photo.hex

    def store_whole(self, photo: UUID, source: Path) -> None:
        """Store a file of this machine as a complete upload; an unfinished upload is replaced."""
        self.drop(photo)
        self.begin(photo, source.stat().st_size)
        with self.appending(photo, 0) as stream:
            stream.write(source.read_bytes())

    def begin(self, photo: UUID, size: int, others: Mapping[UUID, int] = _NO_OTHERS) -> None:
        """Reserve space for a file of so many bytes.

        Parameters
        ----------
        others : sizes of the photos that were announced before and are not complete.

        Raises
        ------
        EnvironmentLacksError : the disk is too full for all of them.
        """
        self.check_room(self._needed(size, 0) + self.reserved(others))
        self.path(photo).touch()

    def reserved(self, photos: Mapping[UUID, int]) -> int:
        """Return the bytes that announced photos will still take.

        A photo without new bytes for an hour reserves nothing; it resumes if there is space.
        """
        total, since = 0, time.time() - _HELD_S
        for photo, size in photos.items():
            try:
                there = self.path(photo).stat()
            except FileNotFoundError:
                continue
            if there.st_mtime >= since:
                total += self._needed(size, there.st_size)
        return total

    def _needed(self, size: int, offset: int) -> int:
        """Return the bytes that a photo will still take: its rest, and its copy in a store on the
        same disk."""
        return size - offset + (size if self._copied else 0)

    def check_room(self, size: int = 0) -> None:
        """Refuse bytes that would leave the database without space.

        Raises
        ------
        EnvironmentLacksError : the disk is too full for so many bytes more.
        """
        if self.free() - size < self._keep_free:
            raise UnavailableError("disk-full", "disk-operator")

    def check_copy(self, photo: UUID) -> None:
        """Check the space for a complete file's copy in the store, as `check_room`."""
        self.check_room(self.offset(photo) if self._copied else 0)

    def free(self) -> int:
        """Return the free bytes of the disk."""
        return shutil.disk_usage(self._folder).free

    def fullness(self) -> Fullness:
        """Return how full the disk is; uploads are refused when it is nearly full."""
        free = self.free()
        if free < self._keep_free / _LAST_PART:
            return "full"
        return "nearly full" if free < self._keep_free else "ok"

    def offset(self, photo: UUID) -> int:
        """Return the number of stored bytes; 0 without a file."""
        try:
            return self.path(photo).stat().st_size
        except FileNotFoundError:
            return 0

    @contextmanager
    def appending(self, photo: UUID, offset: int) -> Iterator[IO[bytes]]:
        """Open a file for appending at `offset`; it is synced to disk however the block ends.

        Raises
        ------
        ConflictError : the file has another length, or another request is writing it.
        EnvironmentLacksError : the disk is too full, or became so meanwhile.
        """
        self.check_room()
        try:
            with self.path(photo).open("ab") as stream:
                _lock_upload(stream, offset)
                try:
                    yield stream
                finally:
                    stream.flush()
                    os.fsync(stream.fileno())
        except OSError as error:
            raise UnavailableError("cannot-write", why=error.strerror) from error

    def photos(self) -> set[UUID]:
        """Return the photos that have a file here; other files are ignored."""
        names = (path.name for path in self._folder.iterdir())
        return {UUID(name) for name in names if _PHOTO.fullmatch(name)}

    def drop(self, photo: UUID) -> None:
        """Delete a file."""
        self.path(photo).unlink(missing_ok=True)


def _lock_upload(stream: IO[bytes], offset: int) -> None:
    """Lock a file for one request at a time."""
    if not take_lock(stream):
        raise ConflictError("upload-busy")
    here = os.fstat(stream.fileno()).st_size
    if here != offset:
        raise ConflictError("offset-other", "offset-ask", count=here, offset=offset)
