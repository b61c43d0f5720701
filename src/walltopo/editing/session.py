"""An edit session: a scan kept in memory, on which edits are previewed, saved and carried out.

Previewing and carrying out are one code, `walltopo.editing.replay`, on the files of the scan.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, WalltopoError
from walltopo.core.errors import problem_key
from walltopo.editing.artifact_cache import ArtifactCache
from walltopo.editing.crops import crops_of
from walltopo.editing.log_file import log_version, read_log, save_log
from walltopo.editing.messages import Crop, EditResult, RebuildStatus
from walltopo.editing.replay import Outcome, replay
from walltopo.editing.results import result_of, shown_labels
from walltopo.editing.settings import EditSettings
from walltopo.editing.snapshot import ScanSnapshot, SnapshotFiles
from walltopo.scans.artifacts import Load, load_bundle
from walltopo.scans.edits import EditLog, Place
from walltopo.scans.folder import ScanFolder


class Rebuilder(Protocol):
    """The stages that follow from the log; `walltopo.pipeline.edit_session` has the real ones."""

    @property
    def settings(self) -> EditSettings:
        """Return the settings that the scan was made with."""

    def is_stale(self) -> bool:
        """Return whether a stage after the log would run again."""

    def hold(self) -> AbstractContextManager[None]:
        """Keep other runs out of the scan folder; raises BusyError."""

    def run(self, load: Load) -> None:
        """Bring the stages after the log up to date; the folder is held."""


class EditSession:
    """A scan on which edits are previewed and saved; a thread rebuilds the files after a save.

    Its files are read once and kept while they stay as they are. Methods may be called from
    several threads.

    Parameters
    ----------
    rebuilder : runs the stages after the log.
    rebuilt : called in that thread with the version of the log that the files show now; an
        exception that it raises becomes the problem of the status.
    """

    def __init__(
        self,
        folder: ScanFolder,
        rebuilder: Rebuilder,
        rebuilt: Callable[[str], None] | None = None,
    ) -> None:
        self.folder = folder
        self._rebuilder, self._rebuilt = rebuilder, rebuilt
        self._cache = ArtifactCache()
        self._replaying = threading.Lock()
        self._saving = threading.Lock()  # also: no run sweeps the folder while a file is written
        self._kept: tuple[SnapshotFiles, ScanSnapshot] | None = None
        self._touched: NDArray[np.bool_] | None = None
        self._worker: threading.Thread | None = None
        self._turn = threading.Lock()
        self._wanted = self._running = False
        self._done = "" if rebuilder.is_stale() else log_version(folder)
        self._problem = self._problem_key = ""

    def read(self) -> tuple[EditLog, str]:
        """Return the log and its version."""
        return read_log(self.folder)

    def preview(self, log: EditLog) -> EditResult:
        """Return what a log makes of the scan; writes nothing."""
        with self._replaying:
            snapshot = self._snapshot()
            outcome = replay(snapshot, log.edits)
            return result_of(snapshot, outcome, self._touch(snapshot, outcome))

    def save(self, log: EditLog, version: str) -> tuple[EditResult, str]:
        """Save a log that was made on a version and begin the rebuild; return result and version.

        Raises
        ------
        EditsChangedError : other edits were saved since that version.
        """
        result = self.preview(log)  # before it is saved: one that cannot be replayed is refused
        now = self.write(log, version)
        self.rebuild()
        return result, now

    def write(self, log: EditLog, version: str | None = None) -> str:
        """Save a log without a rebuild; return its version.

        Parameters
        ----------
        version : that the log was made on; None replaces any log.
        """
        with self._saving:
            expected = log_version(self.folder) if version is None else version
            return save_log(self.folder, log, expected)

    def outcome(self, log: EditLog) -> tuple[Outcome, ScanSnapshot]:
        """Return the holds and routes that a log makes, with the scan before it."""
        with self._replaying:
            snapshot = self._snapshot()
            return replay(snapshot, log.edits), snapshot

    def status(self) -> RebuildStatus:
        """Return whether the files of the scan show the log that is saved."""
        stale = self._done != log_version(self.folder)
        return RebuildStatus(stale, self._running, self._done, self._problem, self._problem_key)

    def crops(self, at: Place) -> list[Crop]:
        """Return a place of the wall in the photos that show it best."""
        with self._replaying:
            return crops_of(self._snapshot(), at)

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
            version = log_version(self.folder)
            self._problem = self._problem_key = ""
            try:
                with ExitStack() as stack:
                    with self._saving:
                        stack.enter_context(self._rebuilder.hold())
                    self._rebuilder.run(self._cache.load)
                    if self._rebuilt is not None:
                        self._rebuilt(version)
                self._done = version
            except WalltopoError as error:
                self._problem, self._problem_key = str(error), problem_key(error)
            except Exception as error:  # the page must show it, and the server go on
                self._problem = f"{type(error).__name__}: {error}"

    def _snapshot(self) -> ScanSnapshot:
        """Return the scan before edits; built anew where a file of it changed."""
        files = load_bundle(self.folder, SnapshotFiles, self._cache.load)
        names = [field.name for field in fields(SnapshotFiles) if field.name != "edits"]
        if self._kept is not None:
            before = self._kept[0]
            if all(getattr(before, name) is getattr(files, name) for name in names):
                return self._kept[1]
        snapshot = ScanSnapshot.of(files, self._rebuilder.settings)
        self._kept, self._touched = (files, snapshot), None
        return snapshot

    def _touch(self, snapshot: ScanSnapshot, outcome: Outcome) -> NDArray[np.bool_]:
        """Return (F,) triangles that any log of this session changed, or the log before it.

        A page shows the labels that were in the files when it was loaded, whichever these were.
        """
        found = (hold.id for hold in snapshot.found.instances)
        before = shown_labels(snapshot.labels, found)
        if self._touched is None:
            self._touched = np.zeros(len(before), dtype=bool)
            with suppress(InputError):
                self._touched |= before != self._written(snapshot)
        rows = (row.id for row in outcome.holds.holds)
        self._touched |= before != shown_labels(outcome.labels, rows)
        return self._touched

    def _written(self, snapshot: ScanSnapshot) -> NDArray[np.int32]:
        """Return the labels that the files of the scan have."""
        change = self._cache.load(self.folder, ScanFolder.relabelled)
        labels = snapshot.labels if change is None else change.on(snapshot.labels)
        rows = self._cache.load(self.folder, ScanFolder.holds).holds
        return shown_labels(labels, (row.id for row in rows))
