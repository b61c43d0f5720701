"""Read and save `edits.json`, so that no save is lost."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.errors import EditsChangedError
from walltopo.core.files import atomic_path, hash_path
from walltopo.core.locks import take_lock
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder


def log_version(scan: ScanFolder) -> str:
    """Return a text that changes whenever `edits.json` changes, by any program."""
    return hash_path(scan.edits) or "none"


def read_log(scan: ScanFolder) -> tuple[EditLog, str]:
    """Return the log of a scan and its version; an empty log without a file.

    The version is read first. If a save happens in between, the next save is refused, not lost.

    Raises
    ------
    InputError : a file is invalid (the message names the file and the entry).
    """
    version = log_version(scan)
    return ScanFolder.edits.load(scan) or EditLog(), version


def save_log(scan: ScanFolder, log: EditLog, version: str) -> str:
    """Write the log and return its new version.

    The temporary file is read back before it replaces the log.

    Parameters
    ----------
    version : version of the log on which the edits are based.

    Raises
    ------
    EditsChangedError : the log has another version now.
    EnvironmentLacksError : the folder is not writable.
    """
    with _locked(scan):
        if version != log_version(scan):
            raise EditsChangedError(
                "other edits were saved since this page read them; nothing was changed",
                "Reload to continue from those; your changes since then will be lost.",
            )
        if scan.edits.exists() and not scan.edits.is_file():
            raise InputError(f"{scan.edits.name} exists but is not a file")
        with atomic_path(scan.edits) as temporary:
            log.save(temporary)
            if EditLog.load(temporary) != log:
                raise InputError("edits: the saved file would read differently")
        return log_version(scan)


@contextmanager
def _locked(scan: ScanFolder) -> Iterator[None]:
    """Allow one save at a time, over threads and servers, from the check to the write."""
    try:
        stream = (scan.root / ".edits.lock").open("w")
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {scan.root}: {error.strerror}") from error
    with stream:
        take_lock(stream, wait=True)
        yield
