"""Scans that are open for editing in this process: few, because each keeps a wall in memory."""

from __future__ import annotations

import shutil
import threading
from collections import OrderedDict
from pathlib import Path
from typing import Final
from uuid import UUID

from walltopo.editing.log_file import log_version
from walltopo.editing.messages import RebuildStatus
from walltopo.pipeline.edit_session import STAGES_AFTER_LOG, open_session
from walltopo.scans.folder import ScanFolder
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import TooManyError
from walltopo_gym.scans.artifacts import (
    download_scan,
    store_public_files,
    upload_files,
    upload_stage,
)
from walltopo_gym.scans.edits import mark_shown, read_log
from walltopo_gym.scans.pictures import keep_front
from walltopo_gym.storage.files import FileStore


class OpenScan:
    """A scan's folder, downloaded from the store, and its edit session (`session`).

    The database has the log; the folder's `edits.json` is a copy. After a save the results are
    computed here, uploaded to the store, and then shown. If this process dies before, the next
    process that opens the scan computes them again.
    """

    def __init__(self, scan: UUID, folder: Path, database: Database, store: FileStore) -> None:
        self.scan = scan
        self._database, self._store = database, store
        shutil.rmtree(folder, ignore_errors=True)
        self._folder = ScanFolder(folder)
        download_scan(store, scan, self._folder)
        with database.reading() as session:
            saved = read_log(session, scan)
        saved.log.save(self._folder.edits)
        self._turn = threading.Lock()
        self._revisions = {log_version(self._folder): saved.revision}
        self.session = open_session(self._folder, self._upload_results)
        if saved.is_pending:
            self.session.rebuild()

    def carry_out(self) -> None:
        """Compute the results of the saved log."""
        with self._turn:
            with self._database.reading() as session:
                saved = read_log(session, self.scan)
            if saved.revision not in self._revisions.values():
                # Written under the session's lock, so that no run reads it half-way.
                version = self.session.write(saved.log)
                self._revisions[version] = saved.revision
            if saved.is_pending:
                self.session.rebuild()

    def state(self) -> RebuildStatus:
        """Return the progress; resume what another process left unfinished."""
        now = self.session.status()
        with self._database.reading() as session:
            saved = read_log(session, self.scan)
        if saved.is_pending and not now.running and not now.problem:
            self.carry_out()
            now = self.session.status()
        return RebuildStatus(
            stale=saved.is_pending, running=now.running, done_version=str(saved.shown),
            problem=now.problem, key=now.key,
        )  # fmt: skip

    @property
    def is_idle(self) -> bool:
        """Return whether nothing is being computed."""
        return not self.session.status().running

    def close(self) -> None:
        """Wait for pending writes and delete the local files."""
        self.session.close()
        shutil.rmtree(self._folder.root, ignore_errors=True)

    def _upload_results(self, version: str) -> None:
        """Upload the folder's results: files first, then the row that names them."""
        for stage in STAGES_AFTER_LOG:
            upload_stage(self._store, self.scan, self._folder, stage)
        upload_files(self._store, self.scan, self._folder, self._folder.edits)
        files = store_public_files(self._store, self._folder)
        keep_front(self._store, self.scan, self._folder)
        with self._database.writing() as session:
            mark_shown(session, self.scan, self._revisions[version], files)


_SOON_S: Final = 60


class EditSessions:
    """Opens scans, and closes the least recently used ones.

    Parameters
    ----------
    folder : for scan folders of this process alone.
    max_open : maximum number of open scans.
    """

    def __init__(self, folder: Path, max_open: int, database: Database, store: FileStore) -> None:
        self._folder, self._max = folder, max_open
        self._database, self._store = database, store
        self._opening = threading.Lock()
        self._opened: OrderedDict[UUID, OpenScan] = OrderedDict()

    def of(self, scan: UUID) -> OpenScan:
        """Return an opened scan; the first time takes as long as loading it.

        Raises
        ------
        TooManyError : the limit is reached, and no open scan can be closed now.
        """
        with self._opening:
            found = self._opened.get(scan)
            if found is None:
                self._make_room()
                folder = self._folder / str(scan)
                found = OpenScan(scan, folder, self._database, self._store)
                self._opened[scan] = found
            self._opened.move_to_end(scan)
            return found

    def close(self) -> None:
        """Close all."""
        with self._opening:
            while self._opened:
                self._opened.popitem()[1].close()

    def _make_room(self) -> None:
        while len(self._opened) >= self._max:
            idle = next((one for one in self._opened.values() if one.is_idle), None)
            if idle is None:
                raise TooManyError("editor-busy", _SOON_S)
            self._opened.pop(idle.scan).close()
