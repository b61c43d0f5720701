"""The steps of a scan's job, each of which may be done again: fetch, one a stage, finish."""

from __future__ import annotations

import json
import logging
import shutil
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from sqlalchemy import select, update

from walltopo.scans.folder import ScanFolder
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.scans.job import Failed, Job
from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.pictures import keep_front
from walltopo_gym.scans.running import RunningScan
from walltopo_gym.scans.shelf import shelve_stage, take_scan, take_visible
from walltopo_gym.scans.states import State, move
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore
from walltopo_gym.uploads.models import Photo
from walltopo_gym.uploads.receiving import suffix_of

_LOG = logging.getLogger("walltopo_gym.scans")
_LOOK_S = 0.5  # how often the row is written, and looked at


class WorkerStopsError(BaseException):
    """The worker lets go of a scan in the middle of a step, which has then no result.

    No `Exception`: DBOS writes those down as what the step came to. The workflow stays as it is,
    and goes on when a worker is there again.
    """


@dataclass
class ScanSteps:
    """What a worker does for a scan.

    Parameters
    ----------
    work : folder for scan folders on this worker's disk.
    running : the children, by scan and run.
    """

    settings: GymSettings
    database: Database
    store: FileStore
    work: Path
    running: dict[tuple[UUID, int], RunningScan] = field(default_factory=dict)
    stopping: threading.Event = field(default_factory=threading.Event)

    @classmethod
    def of(cls, settings: GymSettings, database: Database, store: FileStore) -> ScanSteps:
        """With its scan folders in the data folder."""
        return cls(settings, database, store, settings.data / "work")

    def claim(self, scan: UUID, run: int) -> bool:
        """Begin; False where the scan was cancelled, started anew or deleted meanwhile."""
        try:
            with self.database.writing() as session:
                move(session, scan, State.RUNNING, run=run)
                session.merge(ScanProgress(scan_id=scan, doing="fetching the photos", at=now()))
        except ConflictError as error:
            _LOG.info("scan %s, run %s: not begun (%s)", scan, run, error)
            return False
        return True

    def stage(self, scan: UUID, run: int, stage: str) -> str:
        """See one stage to its end; empty where all is well, else why not."""
        child = self.running.get((scan, run))
        if child is None:
            child = self.running[scan, run] = RunningScan(self._prepare(scan))
        limit = time.monotonic() + self.settings.stage_minutes * 60
        seen = None
        while True:
            with child.told:
                child.told.wait_for(lambda: stage in child.ended or child.exit is not None, _LOOK_S)
                state = (child.step, child.done, tuple(child.notes))
                is_done, failure, code = stage in child.ended, child.failure, child.exit
            if self.stopping.is_set() or self.running.get((scan, run)) is not child:
                raise WorkerStopsError
            if is_done:
                shelve_stage(self.store, scan, self._folder(scan), stage)
                return ""
            if failure is not None:
                return told(failure)
            if code is not None:
                return told(Failed(f"the scan ended in {stage} (exit code {code})", "", True))
            too_much = self._too_much(stage, child, limit)
            if too_much is not None:
                return told(too_much)
            if not self._tell(scan, run, state if state != seen else None):
                return told(Failed("cancelled", "", defect=False))
            seen = state

    def _too_much(self, stage: str, child: RunningScan, limit: float) -> Failed | None:
        """Whether a stage takes more than it may, of time or of memory."""
        hint = "Fewer photos make a scan faster and smaller."
        if time.monotonic() > limit:
            minutes = self.settings.stage_minutes
            return Failed(f"{stage} took longer than {minutes} minutes", hint, defect=False)
        most = self.settings.stage_memory_mb
        if most and child.memory_mb() > most:
            return Failed(f"{stage} wanted more than {most} MB of memory", hint, defect=False)
        return None

    def finish(self, scan: UUID, run: int) -> None:
        """Hand the wall over to the setter."""
        folder = self._folder(scan)
        files = take_visible(self.store, folder)
        keep_front(self.store, scan, folder)
        with self.database.writing() as session:
            move(session, scan, State.REVIEW, run=run)
            session.execute(update(Scan).where(Scan.id == scan).values(files=files))

    def fail(self, scan: UUID, run: int, why: str) -> None:
        """Say why it came to nothing; unless somebody has cancelled it, or started it anew."""
        failure = json.loads(why)
        error, hint = failure["message"], failure["hint"]
        if failure["defect"]:
            _LOG.error("scan %s, run %s: %s", scan, run, error)
            error, hint = "the scan failed by a fault of the program", "The operator's log has it."
        change = update(Scan).where(Scan.id == scan, Scan.run == run, Scan.state == State.RUNNING)
        with self.database.writing() as session:
            session.execute(change.values(state=State.FAILED, error=error[:2000], hint=hint[:2000]))

    def stop(self) -> None:
        """End all children; what they had not finished is done again."""
        self.stopping.set()
        self.abandon()

    def abandon(self) -> None:
        """End all children: their scans are others' now."""
        while self.running:
            _, child = self.running.popitem()
            child.stop()

    def release(self, scan: UUID, run: int) -> None:
        """End what still runs, and free this worker's disk."""
        child = self.running.pop((scan, run), None)
        if child is not None:
            child.stop()
        shutil.rmtree(self._folder(scan).root.parent, ignore_errors=True)

    def _folder(self, scan: UUID) -> ScanFolder:
        return ScanFolder(self.work / str(scan) / "scan")

    def _prepare(self, scan: UUID) -> Job:
        """Photos, what was done before, and the reference, on this worker's disk."""
        with self.database.reading() as session:
            reference = session.get_one(Scan, scan).reference_id
            usable = select(Photo).where(Photo.scan_id == scan, Photo.state == "usable")
            photos = list(session.scalars(usable.order_by(Photo.created_at, Photo.id)))
        folder = self._folder(scan)
        sources = folder.root.parent / "photos"
        for number, photo in enumerate(photos, start=1):
            path = sources / f"{number:04d}{suffix_of(photo.name)}"
            if not path.exists():
                self.store.fetch(photo.original, path)
        take_scan(self.store, scan, folder)
        words = []
        if reference is not None:
            before = ScanFolder(folder.root.parent / "reference")
            take_scan(self.store, reference, before)
            words.append(f"sparse.reference={json.dumps(str(before.root.absolute()))}")
        config = str(self.settings.scan_settings or "")
        return Job(str(sources), str(folder.root), config, words)

    def _tell(self, scan: UUID, run: int, state: object) -> bool:
        """Write down how far it is; False where it shall not go on."""
        with self.database.reading() as session:
            row = session.get(Scan, scan)
            if row is None or row.run != run or row.state != State.RUNNING:
                return False
        if isinstance(state, tuple):
            step, done, notes = state
            row_now = ScanProgress(
                scan_id=scan, stage=step.stage, doing=step.doing[:200], done=done,
                total=step.total, notes=list(notes), at=now(),
            )  # fmt: skip
            with self.database.writing() as session:
                if session.get(Scan, scan) is not None:
                    session.merge(row_now)
        return True


def told(failure: Failed) -> str:
    """As a step's result, which DBOS keeps."""
    return json.dumps({"message": failure.message, "hint": failure.hint, "defect": failure.defect})
