"""Scans that are open for editing in this process: few, because each keeps a wall in memory."""

from __future__ import annotations

import shutil
import threading
from collections import OrderedDict
from pathlib import Path
from typing import IO, Final
from uuid import UUID, uuid4

from walltopo.core.locks import open_locked
from walltopo.editing.messages import EditResult, RebuildStatus
from walltopo.pipeline.edit_session import STAGES_AFTER_LOG, open_session
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder, read_edits
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import TooManyError
from walltopo_gym.publishing.plans import check_unplanned
from walltopo_gym.scans.artifacts import (
    carried_log,
    download_scan,
    store_public_files,
    upload_files,
    upload_stage,
)
from walltopo_gym.scans.edits import SavedLog, mark_shown, read_log, save_log
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.pictures import store_front
from walltopo_gym.scans.queues import gym_of
from walltopo_gym.storage.files import FileStore


class EditLogTable:
    """The edit log of a scan in the database; the folder's `edits.json` is a copy.

    Parameters
    ----------
    author : who saves; None where the log is only read.
    """

    def __init__(
        self, scan: UUID, folder: ScanFolder, database: Database, author: UUID | None = None
    ) -> None:
        self._scan, self._folder = scan, folder
        self._database, self._author = database, author

    def version(self) -> str:
        """Return the number of the last save."""
        return str(self.saved().revision)

    def read(self) -> tuple[EditLog, str]:
        """Return the log and the number of the last save.

        Before the first save it is the log that a partial rescan carried from its reference.
        """
        saved = self.saved()
        log = saved.log if saved.revision else carried_log(self._folder)
        return log, str(saved.revision)

    def save(self, log: EditLog, version: str) -> str:
        """Save a log based on a save; return its own number.

        Raises
        ------
        ConflictError : other edits were saved since, or the scan is not in review any more, or a
            plan publishes it.
        """
        with self._database.writing() as session:
            revision = save_log(session, self._scan, log, int(version))
            check_unplanned(session, self._scan)
            log_change(
                session,
                "scan.edit",
                person=self._author,
                gym=gym_of(session, self._scan),
                subject=str(self._scan),
            )
        return str(revision)

    def copy_to_folder(self) -> str:
        """Write the log to the folder's `edits.json`, if that differs; return its number."""
        log, version = self.read()
        if read_edits(self._folder) != log:
            log.save(self._folder.edits)
        return version

    def saved(self) -> SavedLog:
        """Return the log with the numbers of its save and of the save that the files show."""
        with self._database.reading() as session:
            return read_log(session, self._scan)


class OpenScan:
    """A scan's folder, downloaded from the store, and its edit session (`session`).

    After a save the results are computed here, uploaded to the store, and then shown. If this
    process dies before, the next process that opens the scan computes them again.
    """

    def __init__(
        self, scan: UUID, run: int, folder: Path, database: Database, store: FileStore
    ) -> None:
        self.scan, self.run = scan, run
        self._database, self._store = database, store
        shutil.rmtree(folder, ignore_errors=True)
        self._folder = ScanFolder(folder)
        download_scan(store, scan, self._folder)
        self._log = EditLogTable(scan, self._folder, database)
        self._log.copy_to_folder()
        self.session = open_session(self._folder, self._log, self._upload_results)
        self.state()  # resumes what another process left unfinished

    def save(self, log: EditLog, version: str, author: UUID) -> tuple[EditResult, str]:
        """Save a log, as `EditSession.save` does, in the name of a person."""
        store = EditLogTable(self.scan, self._folder, self._database, author)
        return self.session.save(log, version, store)

    def state(self) -> RebuildStatus:
        """Return the progress; resume what another process left unfinished."""
        now, saved = self.session.status(), self._log.saved()
        if saved.is_pending and not now.running and not now.problem:
            self.session.rebuild()
            now = self.session.status()
        return RebuildStatus(
            stale=saved.is_pending,
            running=now.running,
            done_version=str(saved.shown),
            problem=now.problem,
            key=now.key,
        )

    @property
    def is_idle(self) -> bool:
        """Return whether nothing is being computed."""
        return not self.session.status().running

    def close(self) -> None:
        """Wait for pending writes and delete the local files."""
        self.session.close()
        shutil.rmtree(self._folder.root, ignore_errors=True)

    def _upload_results(self, version: str) -> None:
        """Upload the folder's results: files first, then the row that names them.

        Those of an earlier run of the scan are dropped, and those of an earlier save: a later one
        may have been saved at another server, which uploads its own.
        """
        with self._database.turn_of(f"results {self.scan}"):
            with self._database.reading() as session:
                row, saved = session.get(Scan, self.scan), read_log(session, self.scan)
            if row is not None and row.run == self.run and saved.revision == int(version):
                self._upload(version)

    def _upload(self, version: str) -> None:
        for stage in STAGES_AFTER_LOG:
            upload_stage(self._store, self.scan, self._folder, stage)
        upload_files(self._store, self.scan, self._folder, self._folder.edits)
        files = store_public_files(self._store, self._folder)
        store_front(self._store, self.scan, self._folder)
        with self._database.writing() as session:
            mark_shown(session, self.scan, int(version), files)


class OwnFolder:
    """A folder of this process in a folder of many, created when it is first needed.

    Another process may use the same data folder. A lock beside the folder tells that its process
    lives; folders of others, which a kill left, are deleted.
    """

    def __init__(self, parent: Path) -> None:
        self._parent = parent
        self._lock: IO[bytes] | None = None
        self._path: Path | None = None

    def path(self) -> Path:
        """Return the folder."""
        if self._path is None:
            self._parent.mkdir(parents=True, exist_ok=True)
            self._delete_abandoned()
            name = uuid4().hex
            self._lock = open_locked(self._parent / f"{name}.lock")
            self._path = self._parent / name
            self._path.mkdir()
        return self._path

    def close(self) -> None:
        """Delete the folder."""
        if self._path is None or self._lock is None:
            return
        shutil.rmtree(self._path, ignore_errors=True)
        self._lock.close()
        (self._parent / f"{self._path.name}.lock").unlink(missing_ok=True)
        self._path = self._lock = None

    def _delete_abandoned(self) -> None:
        for entry in self._parent.iterdir():
            if entry.suffix == ".lock":
                continue
            path = self._parent / f"{entry.name}.lock"
            lock = open_locked(path)
            if lock is not None:
                with lock:
                    shutil.rmtree(entry, ignore_errors=True)
                    path.unlink(missing_ok=True)


_SOON_S: Final = 60


class EditSessions:
    """Opens scans, and closes the least recently used ones.

    Parameters
    ----------
    folder : for the folders of all processes on this machine; each has one of its own in it.
    max_open : maximum number of open scans.
    """

    def __init__(self, folder: Path, max_open: int, database: Database, store: FileStore) -> None:
        self._own, self._max = OwnFolder(folder), max_open
        self._database, self._store = database, store
        self._opening = threading.Lock()
        self._opened: OrderedDict[UUID, OpenScan] = OrderedDict()

    def of(self, scan: UUID, run: int) -> OpenScan:
        """Return an opened scan; the first time takes as long as loading it.

        Parameters
        ----------
        run : the scan's; the results of another run are closed.

        Raises
        ------
        TooManyError : the limit is reached, and no open scan can be closed now.
        """
        with self._opening:
            found = self._opened.get(scan)
            if found is not None and found.run != run:
                self._opened.pop(scan).close()
                found = None
            if found is None:
                self._make_room()
                folder = self._own.path() / str(scan)
                found = OpenScan(scan, run, folder, self._database, self._store)
                self._opened[scan] = found
            self._opened.move_to_end(scan)
            return found

    def close(self) -> None:
        """Close all."""
        with self._opening:
            while self._opened:
                self._opened.popitem()[1].close()
            self._own.close()

    def _make_room(self) -> None:
        while len(self._opened) >= self._max:
            idle = next((one for one in self._opened.values() if one.is_idle), None)
            if idle is None:
                raise TooManyError("editor-busy", _SOON_S)
            self._opened.pop(idle.scan).close()
