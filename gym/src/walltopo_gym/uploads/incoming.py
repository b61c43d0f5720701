"""Files that are being received: each grows in the data folder until it is whole.

How much of a file is here is its length on the disk and nothing else: a killed server has what it
has written, and says so.
"""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import IO, Literal
from uuid import UUID

from walltopo.core import EnvironmentLacksError
from walltopo_gym.errors import ConflictError

Fullness = Literal["ok", "nearly full", "full"]

_MB = 1_000_000
_HELD_S = 3600
_LAST_PART = 10  # with a tenth of what is kept free the database itself is about to stop
_NO_OTHERS: Mapping[UUID, int] = MappingProxyType({})
_PHOTO = re.compile(r"[0-9a-f]{32}")


class Incoming:
    """The folder of unfinished files.

    Parameters
    ----------
    folder : made if it is not there.
    keep_free_mb : nothing is received when the disk has less left.
    copied : whole files are copied to a store on the same disk before they go.
    """

    def __init__(self, folder: Path, keep_free_mb: int, *, copied: bool = True) -> None:
        self._folder, self._keep_free, self._copied = folder, keep_free_mb * _MB, copied
        folder.mkdir(parents=True, exist_ok=True)

    def path(self, photo: UUID) -> Path:
        """Where the file of this photo grows."""
        return self._folder / photo.hex

    def begin(self, photo: UUID, size: int, others: Mapping[UUID, int] = _NO_OTHERS) -> None:
        """Make room for a file of so many bytes.

        Parameters
        ----------
        others : sizes of the photos that were announced before and are not whole.

        Raises
        ------
        EnvironmentLacksError : the disk is too full for it and for those.
        """
        self.check_room(self._needed(size, 0) + self.reserved(others))
        self.path(photo).touch()

    def reserved(self, photos: Mapping[UUID, int]) -> int:
        """Return the bytes that announced photos will still take.

        A photo of which nothing came for an hour holds no room; it goes on where there is some.
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
        """What a photo still takes: the rest of it, and its copy in a store on the same disk."""
        return size - offset + (size if self._copied else 0)

    def check_room(self, size: int = 0) -> None:
        """Nothing is received that would leave the database without room.

        Raises
        ------
        EnvironmentLacksError : the disk is too full for so many bytes more.
        """
        if self.free() - size < self._keep_free:
            raise EnvironmentLacksError(
                "the server's disk is nearly full", "Its operator has to make room first."
            )

    def check_copy(self, photo: UUID) -> None:
        """As `check_room`, for the copy of a whole file in the store."""
        self.check_room(self.offset(photo) if self._copied else 0)

    def free(self) -> int:
        """Return the free bytes of the disk."""
        return shutil.disk_usage(self._folder).free

    def fullness(self) -> Fullness:
        """Return how full the disk is: uploads are refused when it is nearly full."""
        free = self.free()
        if free < self._keep_free / _LAST_PART:
            return "full"
        return "nearly full" if free < self._keep_free else "ok"

    def offset(self, photo: UUID) -> int:
        """How many bytes are here; 0 where nothing is."""
        try:
            return self.path(photo).stat().st_size
        except FileNotFoundError:
            return 0

    @contextmanager
    def appending(self, photo: UUID, offset: int) -> Iterator[IO[bytes]]:
        """Write on at `offset`; on the disk when the block ends, whatever ended it.

        Raises
        ------
        ConflictError : the file is not as long as that, or somebody else is writing it.
        EnvironmentLacksError : the disk is too full, or became so meanwhile.
        """
        self.check_room()
        try:
            with self.path(photo).open("ab") as stream:
                _take(stream, offset)
                try:
                    yield stream
                finally:
                    stream.flush()
                    os.fsync(stream.fileno())
        except OSError as error:
            raise EnvironmentLacksError(f"the server cannot write ({error.strerror})") from error

    def photos(self) -> set[UUID]:
        """The photos of which there is a file here; other files are left alone."""
        names = (path.name for path in self._folder.iterdir())
        return {UUID(name) for name in names if _PHOTO.fullmatch(name)}

    def drop(self, photo: UUID) -> None:
        """Forget a file."""
        self.path(photo).unlink(missing_ok=True)


def _take(stream: IO[bytes], offset: int) -> None:
    """One request at a time sends a file, from where it ends."""
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise ConflictError("another request is sending this file") from error
    here = os.fstat(stream.fileno()).st_size
    if here != offset:
        raise ConflictError(f"{here} bytes are here, not {offset}", "Ask where to go on.")
