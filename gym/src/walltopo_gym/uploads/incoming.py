"""Files that are being received: each grows in the data folder until it is whole.

How much of a file is here is its length on the disk and nothing else: a killed server has what it
has written, and says so.
"""

from __future__ import annotations

import fcntl
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO
from uuid import UUID

from walltopo.core import EnvironmentLacksError
from walltopo_gym.errors import ConflictError

__all__ = ["Incoming"]

_MB = 1_000_000
_PHOTO = re.compile(r"[0-9a-f]{32}")


class Incoming:
    """The folder of unfinished files.

    Parameters
    ----------
    folder : made if it is not there.
    keep_free_mb : nothing is received when the disk has less left.
    """

    def __init__(self, folder: Path, keep_free_mb: int) -> None:
        self._folder, self._keep_free_mb = folder, keep_free_mb
        folder.mkdir(parents=True, exist_ok=True)

    def path(self, photo: UUID) -> Path:
        """Where the file of this photo grows."""
        return self._folder / photo.hex

    def begin(self, photo: UUID, size: int) -> None:
        """Make room for a file of so many bytes.

        Raises
        ------
        EnvironmentLacksError : the disk is too full for it.
        """
        self.check_room(size)
        self.path(photo).touch()

    def check_room(self, size: int = 0) -> None:
        """Nothing is received that would leave the database without room.

        Raises
        ------
        EnvironmentLacksError : the disk is too full for so many bytes more.
        """
        free = shutil.disk_usage(self._folder).free
        if free - size < self._keep_free_mb * _MB:
            raise EnvironmentLacksError(
                "the server's disk is nearly full", "Its operator has to make room first."
            )

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
