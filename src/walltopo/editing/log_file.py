"""Reading and saving `edits.json`, so that no save is lost."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.errors import EditsChangedError
from walltopo.core.files import atomic_path, hash_path
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder


def log_version(scan: ScanFolder) -> str:
    """Return a text that changes when `edits.json` does, whoever writes it."""
    return hash_path(scan.edits) or "none"


def read_log(scan: ScanFolder) -> tuple[EditLog, str]:
    """Return the log of a scan and its version; an empty log where there is none.

    The version is taken first: where a save falls between, the next save is refused, not lost.

    Raises
    ------
    InputError : a file is not what it should be; names it and the entry.
    """
    version = log_version(scan)
    return ScanFolder.edits.load(scan) or EditLog(), version


def save_log(scan: ScanFolder, log: EditLog, version: str) -> str:
    """Write the log; gives its new version.

    It is read back before it takes its place.

    Parameters
    ----------
    version : of the files that the edits were made on.

    Raises
    ------
    EditsChangedError : the files have another version now.
    EnvironmentLacksError : they cannot be written.
    """
    with _alone(scan):
        if version != log_version(scan):
            raise EditsChangedError(
                "other edits were saved since this page read them; nothing was changed",
                "Reload to go on from those: what was done here since is then gone.",
            )
        if scan.edits.exists() and not scan.edits.is_file():
            raise InputError(f"{scan.edits.name} is in the way: it is not a file")
        with atomic_path(scan.edits) as temporary:
            log.save(temporary)
            if EditLog.load(temporary) != log:
                raise InputError("edits: they would read differently from the file")
        return log_version(scan)


@contextmanager
def _alone(scan: ScanFolder) -> Iterator[None]:
    """One save at a time, over threads and servers, so that none falls between look and write."""
    try:
        stream = (scan.root / ".edits.lock").open("w")
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {scan.root}: {error.strerror}") from error
    with stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        yield
