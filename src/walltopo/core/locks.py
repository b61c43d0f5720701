"""Lock open files between processes, on every system."""

from __future__ import annotations

from pathlib import Path
from typing import IO, Any

import portalocker

from walltopo.core.errors import EnvironmentLacksError


def take_lock(stream: IO[Any], *, wait: bool = False, shared: bool = False) -> bool:
    """Lock an open file until it is closed; return False if another holds it.

    The system releases the lock when the process exits, however it exits.

    Parameters
    ----------
    wait : wait for the lock instead of returning False.
    shared : allow other shared locks, and exclude exclusive ones.

    Raises
    ------
    EnvironmentLacksError : the file system has no locks.
    """
    flags = portalocker.LockFlags.SHARED if shared else portalocker.LockFlags.EXCLUSIVE
    if not wait:
        flags |= portalocker.LockFlags.NON_BLOCKING
    try:
        portalocker.lock(stream, flags)
    except portalocker.AlreadyLocked:
        return False
    except portalocker.LockException as error:
        raise EnvironmentLacksError(
            f"cannot lock {stream.name}: {error}", "Choose a folder on a local disk."
        ) from error
    return True


def open_locked(path: Path) -> IO[bytes] | None:
    """Open a file for writing and lock it; return None if another holds it.

    Raises
    ------
    As `take_lock`.
    """
    stream = path.open("wb")
    if take_lock(stream):
        return stream
    stream.close()
    return None
