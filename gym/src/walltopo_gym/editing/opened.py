"""One scan that is being edited, opened in this process."""

from __future__ import annotations

import shutil
import threading
from pathlib import Path
from uuid import UUID

import msgspec

from walltopo.editing.log_file import log_version
from walltopo.editing.messages import Crop, RebuildStatus
from walltopo.pipeline.edit_session import STAGES_AFTER_LOG, open_session
from walltopo.scans.edits import EditLog, Place
from walltopo.scans.folder import ScanFolder
from walltopo_climb.editor import ease_on, propose_on
from walltopo_climb.problems.ease import Way
from walltopo_climb.problems.wish import Wish
from walltopo_gym.database.engine import Database
from walltopo_gym.editing.log import mark_shown, read_log
from walltopo_gym.scans.pictures import keep_front
from walltopo_gym.scans.shelf import shelve, shelve_stage, take_scan, take_visible
from walltopo_gym.storage.files import FileStore


class Opened:
    """A scan's folder taken from the shelf, and the desk on it.

    The database has the log; the folder's `edits.json` is a copy of it. What follows from a save is
    made here, put on the shelf, and then shown. Should this process end before, whoever opens the
    scan next makes it again.
    """

    def __init__(self, scan: UUID, folder: Path, database: Database, store: FileStore) -> None:
        self.scan = scan
        self._database, self._store = database, store
        shutil.rmtree(folder, ignore_errors=True)
        self._folder = ScanFolder(folder)
        take_scan(store, scan, self._folder)
        with database.reading() as session:
            saved = read_log(session, scan)
        saved.log.save(self._folder.edits)
        self._turn = threading.Lock()
        self._revisions = {log_version(self._folder): saved.revision}
        self._session = open_session(self._folder, self._shelve)
        if saved.is_pending:
            self._session.rebuild()

    def tried(self, log: EditLog) -> msgspec.Struct:
        """What a log makes of the scan; writes nothing."""
        return self._session.preview(log)

    def proposed(self, log: EditLog, wish: Wish) -> msgspec.Struct:
        """Problems for the wall as a log makes it; takes seconds, writes nothing."""
        return propose_on(self._session, log, wish)

    def eased(self, log: EditLog, route: int, way: Way) -> msgspec.Struct:
        """What makes a route one grade easier or harder; writes nothing."""
        return ease_on(self._session, log, route, way)

    def carry_out(self) -> None:
        """Make what follows from the log that is saved."""
        with self._turn:
            with self._database.reading() as session:
                saved = read_log(session, self.scan)
            if saved.revision not in self._revisions.values():
                # Written under the desk's own guard: no run reads it half-way.
                version = self._session.write(saved.log)
                self._revisions[version] = saved.revision
            if saved.is_pending:
                self._session.rebuild()

    def state(self) -> RebuildStatus:
        """How far what follows is made here; goes on with what another process left undone."""
        now = self._session.status()
        with self._database.reading() as session:
            saved = read_log(session, self.scan)
        if saved.is_pending and not now.running and not now.problem:
            self.carry_out()
            now = self._session.status()
        return RebuildStatus(
            stale=saved.is_pending, running=now.running, done_version=str(saved.shown),
            problem=now.problem, key=now.key,
        )  # fmt: skip

    def crops(self, at: Place) -> list[Crop]:
        """A place in the photos that show it best."""
        return self._session.crops(at)

    @property
    def is_idle(self) -> bool:
        """Whether nothing is being made."""
        return not self._session.status().running

    def close(self) -> None:
        """Wait until what was begun is written, and free the disk."""
        self._session.close()
        shutil.rmtree(self._folder.root, ignore_errors=True)

    def _shelve(self, version: str) -> None:
        """What the folder shows now, for everybody: files first, then the row that names them."""
        for stage in STAGES_AFTER_LOG:
            shelve_stage(self._store, self.scan, self._folder, stage)
        shelve(self._store, self.scan, self._folder, self._folder.edits)
        files = take_visible(self._store, self._folder)
        keep_front(self._store, self.scan, self._folder)
        with self._database.writing() as session:
            mark_shown(session, self.scan, self._revisions[version], files)
