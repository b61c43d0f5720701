"""The edit log in the scan folder: `edits.json`, read and saved so that no save is lost."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.errors import EditsChangedError
from walltopo.core.files import atomic_path, hash_path
from walltopo.core.locks import take_lock
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder, read_edits


class EditLogFile:
    """The log of a scan that is edited in its folder, by this and other programs."""

    def __init__(self, scan: ScanFolder) -> None:
        self._scan = scan

    def version(self) -> str:
        """Return a text that changes whenever `edits.json` changes, by any program."""
        return hash_path(self._scan.edits) or "none"

    def read(self) -> tuple[EditLog, str]:
        """Return the log and its version; without a file the log that a rescan carried over.

        The version is read first. If a save happens in between, the next save is refused, not
        lost.

        Raises
        ------
        InputError : a file is invalid (the message names the file and the entry).
        """
        version = self.version()
        return read_edits(self._scan), version

    def save(self, log: EditLog, version: str) -> str:
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
        path = self._scan.edits
        with self._locked():
            if version != self.version():
                raise EditsChangedError(
                    "other edits were saved since this page read them; nothing was changed",
                    "Reload to continue from those; your changes since then will be lost.",
                )
            if path.exists() and not path.is_file():
                raise InputError(f"{path.name} exists but is not a file")
            with atomic_path(path) as temporary:
                log.save(temporary)
                if EditLog.load(temporary) != log:
                    raise InputError("edits: the saved file would read differently")
            return self.version()

    def copy_to_folder(self) -> str:
        """Return the version; the log is in the folder already."""
        return self.version()

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Allow one save at a time, over threads and servers, from the check to the write."""
        root = self._scan.root
        try:
            stream = (root / ".edits.lock").open("w")
        except OSError as error:
            raise EnvironmentLacksError(f"cannot write to {root}: {error.strerror}") from error
        with stream:
            take_lock(stream, wait=True)
            yield
