"""One at a time: a backup that copies files, and a purge that deletes them."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from walltopo_gym.errors import ConflictError
from walltopo_gym.storage.files import private_folder


@contextmanager
def alone(data: Path) -> Iterator[None]:
    """Be the only one who backs up or purges this data folder.

    Raises
    ------
    ConflictError : somebody else is at it.
    """
    private_folder(data)
    with (data / "upkeep.lock").open("wb") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise ConflictError("a backup or a purge is under way", "Wait for its end.") from error
        yield
