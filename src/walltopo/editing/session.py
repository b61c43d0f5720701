"""An edit session: a scan kept in memory, on which edits are previewed and saved.

A preview and a rebuild use the same code, `walltopo.editing.replay`, on the files of the scan.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import fields
from typing import Protocol

from walltopo.core import WalltopoError
from walltopo.core.errors import problem_key
from walltopo.editing.caches import ArtifactCache
from walltopo.editing.hiding import hidden_after
from walltopo.editing.messages import Crop, EditResult, RebuildStatus
from walltopo.editing.replay import Outcome, replay
from walltopo.editing.results import result_of
from walltopo.editing.settings import EditSettings
from walltopo.editing.snapshot import ScanSnapshot, SnapshotFiles
from walltopo.editing.view_crops import crops_of
from walltopo.scans.artifacts import Load, load_bundle
from walltopo.scans.edits import EditLog, Place
from walltopo.scans.folder import LogFiles, ScanFolder

_LOGS = {field.name for field in fields(LogFiles)}  # they do not change the scan before any edit


class Rebuilder(Protocol):
    """Runs the stages that follow from the log; see `walltopo.pipeline.edit_session`."""

    @property
    def settings(self) -> EditSettings:
        """Return the settings of the scan."""

    def is_stale(self) -> bool:
        """Return whether a stage after the log would run again."""

    def hold(self) -> AbstractContextManager[None]:
        """Lock the scan folder against other runs; raise BusyError if another run has it."""

    def run(self, load: Load) -> None:
        """Bring the stages after the log up to date; the caller holds the folder."""


class EditLogStore(Protocol):
    """Keeps the log of a scan: `walltopo.editing.log_file.EditLogFile`, or a database."""

    def version(self) -> str:
        """Return a text that changes whenever the log changes, by any program."""

    def read(self) -> tuple[EditLog, str]:
        """Return the log and its version."""

    def save(self, log: EditLog, version: str) -> str:
        """Save a log based on a version, or raise an error; return its own version."""

    def copy_to_folder(self) -> str:
        """Let the folder's `edits.json`, which the stages read, be the log; return its version."""


class EditSession:
    """A scan on which edits are previewed and saved; a thread rebuilds the files after a save.

    The scan's files are read once, and again only when they change. All methods are thread-safe.

    Parameters
    ----------
    store : keeps the log.
    rebuilder : runs the stages after the log.
    rebuilt : called in that thread with the version of the log that the files now match. If it
        raises an exception, that becomes the problem of the status.
    """

    def __init__(
        self,
        folder: ScanFolder,
        store: EditLogStore,
        rebuilder: Rebuilder,
        rebuilt: Callable[[str], None] | None = None,
    ) -> None:
        self.folder = folder
        self._store, self._rebuilder, self._rebuilt = store, rebuilder, rebuilt
        self._cache = ArtifactCache()
        self._replaying = threading.Lock()
        self._saving = threading.Lock()  # also keeps runs from sweeping the folder during a write
        self._kept: tuple[SnapshotFiles, ScanSnapshot] | None = None
        self._worker: threading.Thread | None = None
        self._turn = threading.Lock()
        self._wanted = self._running = False
        self._done = "" if rebuilder.is_stale() else store.version()
        self._problem = self._problem_key = ""

    def read(self) -> tuple[EditLog, str]:
        """Return the log and its version."""
        return self._store.read()

    def preview(self, log: EditLog) -> EditResult:
        """Return the scan after a log, without writing anything."""
        with self._replaying:
            snapshot = self._snapshot()
            outcome = replay(snapshot, log.edits)
            return result_of(snapshot, outcome)

    def save(
        self, log: EditLog, version: str, store: EditLogStore | None = None
    ) -> tuple[EditResult, str]:
        """Save a log based on a version and start the rebuild; return result and new version.

        Parameters
        ----------
        store : saves the log instead of the session's store; for example, it knows the author.

        Raises
        ------
        EditsChangedError : other edits were saved since that version.
        """
        result = self.preview(log)  # before saving: a log that cannot be replayed is refused
        with self._saving:
            now = (store or self._store).save(log, version)
        self.rebuild()
        return result, now

    def outcome(self, log: EditLog) -> tuple[Outcome, ScanSnapshot]:
        """Return the outcome of a log, with the scan before it."""
        with self._replaying:
            snapshot = self._snapshot()
            return replay(snapshot, log.edits), snapshot

    def status(self) -> RebuildStatus:
        """Return whether the files of the scan match the saved log."""
        with self._turn:  # all fields are of one moment
            stale = self._done != self._store.version()
            return RebuildStatus(stale, self._running, self._done, self._problem, self._problem_key)

    def crops(self, at: Place) -> list[Crop]:
        """Return crops of the photos that show a place of the wall best.

        Places that the saved log hides are hidden.
        """
        log, _ = self._store.read()
        with self._replaying:
            return crops_of(self._snapshot(), at, hidden_after(log.edits))

    def rebuild(self) -> None:
        """Bring the stages after the log up to date in a thread, after a running rebuild."""
        with self._turn:
            self._wanted = True
            if not self._running:
                self._running = True
                self._worker = threading.Thread(target=self._work, name="edits", daemon=True)
                self._worker.start()

    def close(self) -> None:
        """Wait for a running rebuild."""
        if self._worker is not None:
            self._worker.join()

    def _work(self) -> None:
        while True:
            with self._turn:
                if not self._wanted:
                    self._running = False
                    return
                self._wanted = False
            self._problem = self._problem_key = ""
            try:
                with ExitStack() as stack:
                    with self._saving:
                        stack.enter_context(self._rebuilder.hold())
                        version = self._store.copy_to_folder()
                    self._rebuilder.run(self._cache.load)
                    if self._rebuilt is not None:
                        self._rebuilt(version)
                self._done = version
            except WalltopoError as error:
                self._problem, self._problem_key = str(error), problem_key(error)
            except Exception as error:  # show the error on the page and keep the server running
                self._problem = f"{type(error).__name__}: {error}"

    def _snapshot(self) -> ScanSnapshot:
        """Return the scan before edits, rebuilt if one of its files changed."""
        files = load_bundle(self.folder, SnapshotFiles, self._cache.load)
        names = [field.name for field in fields(SnapshotFiles) if field.name not in _LOGS]
        if self._kept is not None:
            before = self._kept[0]
            if all(getattr(before, name) is getattr(files, name) for name in names):
                return self._kept[1]
        snapshot = ScanSnapshot.of(files, self._rebuilder.settings)
        self._kept = (files, snapshot)
        return snapshot
