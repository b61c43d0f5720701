"""The steps of a scan's job: fetch, one per stage, finish. Each may be repeated."""

from __future__ import annotations

import json
import logging
import shutil
import threading
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from sqlalchemy import select, update

from walltopo.pipeline.plan import names_of_plan
from walltopo.scans.folder import ScanFolder
from walltopo.scans.scale import Scale
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.scans.artifacts import (
    download_scan,
    drop_joined,
    drop_part,
    store_public_files,
    upload_stage,
)
from walltopo_gym.scans.distance import distance_settings
from walltopo_gym.scans.first_looks import drop_first_look, store_first_look
from walltopo_gym.scans.job import Failed, Job
from walltopo_gym.scans.models import Photo, Scan, ScanEdits, ScanProgress
from walltopo_gym.scans.own_network import network_of
from walltopo_gym.scans.pictures import store_front
from walltopo_gym.scans.queues import gym_of, routes_changed, scan_finished
from walltopo_gym.scans.receiving import suffix_of
from walltopo_gym.scans.running import RunningScan, WorkerStopsError
from walltopo_gym.scans.service import State, change_state
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore

_LOG = logging.getLogger("walltopo_gym.scans")
_LOOK_S = 0.5  # how often the row is written, and looked at


@dataclass
class ScanSteps:
    """The implementation of a scan's steps on a worker.

    Parameters
    ----------
    work : folder for scan folders on this worker's disk.
    running : the child processes, by scan and run.
    """

    settings: GymSettings
    database: Database
    store: FileStore
    work: Path
    running: dict[tuple[UUID, int], RunningScan] = field(default_factory=dict)
    stopping: threading.Event = field(default_factory=threading.Event)

    def claim(self, scan: UUID, run: int) -> bool:
        """Begin a scan; False if it was cancelled, restarted or deleted meanwhile."""
        try:
            with self.database.writing() as session:
                change_state(session, scan, State.RUNNING, run=run)
                session.merge(ScanProgress(scan_id=scan, doing="fetching the photos", at=now()))
        except ConflictError as error:
            _LOG.info("scan %s, run %s: not begun (%s)", scan, run, error)
            return False
        if drop_joined(self.store, scan):
            shutil.rmtree(self._folder(scan).root.parent, ignore_errors=True)
        return True

    def names(self, scan: UUID) -> tuple[str, ...]:
        """Return the names of a scan's stages, in order."""
        with self.database.reading() as session:
            row = session.get(Scan, scan)
            return names_of_plan(part=row is not None and row.part)

    def stage(self, scan: UUID, run: int, stage: str) -> str:
        """Run one stage to its end; return why it failed, empty on success."""
        child = self.running.get((scan, run))
        if child is None:
            child = self.running[scan, run] = RunningScan(self._prepare(scan))
        limit = time.monotonic() + self.settings.stage_minutes * 60
        seen = None
        while True:
            with child.news:
                child.news.wait_for(lambda: stage in child.ended or child.exit is not None, _LOOK_S)
                state = (child.step, child.done, tuple(child.notes))
                is_done, failure, code = stage in child.ended, child.failure, child.exit
            if self.stopping.is_set() or self.running.get((scan, run)) is not child:
                raise WorkerStopsError
            if is_done:
                upload_stage(self.store, scan, self._folder(scan), stage)
                store_first_look(self.store, scan, self._folder(scan), stage)
                return ""
            if failure is not None:
                return failure_message(failure)
            if code is not None:
                return failure_message(
                    Failed(f"the scan ended in {stage} (exit code {code})", "", True)
                )
            too_much = self._too_much(stage, child, limit)
            if too_much is not None:
                return failure_message(too_much)
            if not self._tell(scan, run, state if state != seen else None):
                return failure_message(Failed("cancelled", "", defect=False))
            seen = state

    def _too_much(self, stage: str, child: RunningScan, limit: float) -> Failed | None:
        """Return a failure if a stage exceeds its limits of time or memory."""
        hint = "Fewer photos make a scan faster and smaller."
        if time.monotonic() > limit:
            minutes = self.settings.stage_minutes
            return Failed(f"{stage} took longer than {minutes} minutes", hint, defect=False)
        most = self.settings.stage_memory_mb
        if most and child.memory_mb() > most:
            return Failed(f"{stage} wanted more than {most} MB of memory", hint, defect=False)
        return None

    def finish(self, scan: UUID, run: int) -> None:
        """Put the scan into review."""
        folder = self._folder(scan)
        drop_part(self.store, scan)
        files = store_public_files(self.store, folder)
        store_front(self.store, scan, folder)
        drop_first_look(self.store, scan)
        with self.database.writing() as session:
            change_state(session, scan, State.REVIEW, run=run)
            session.execute(
                update(Scan).where(Scan.id == scan).values(files=files, scale=_scale_of(folder))
            )
            routes_changed(session, scan)
            scan_finished(session, scan, failed=False)

    def fail(self, scan: UUID, run: int, why: str) -> None:
        """Store why the scan failed, unless it was cancelled or restarted."""
        failure = json.loads(why)
        error, hint = failure["message"], failure["hint"]
        if failure["defect"]:
            _LOG.error("scan %s, run %s: %s", scan, run, error)
            error, hint = "the scan failed by a fault of the program", "The operator's log has it."
        change = update(Scan).where(Scan.id == scan, Scan.run == run, Scan.state == State.RUNNING)
        with self.database.writing() as session:
            values = {"state": State.FAILED, "error": error[:2000], "hint": hint[:2000]}
            if session.scalar(change.values(values).returning(Scan.id)) is not None:
                scan_finished(session, scan, failed=True)

    def stop(self) -> None:
        """Kill all child processes; unfinished stages are repeated."""
        self.stopping.set()
        self.keep(())

    def keep(self, workflows: Collection[str]) -> None:
        """Kill all child processes but those of these workflows; other workers have the other
        scans."""
        for scan, run in list(self.running):
            if f"{scan}-{run}" not in workflows:
                self.running.pop((scan, run)).stop()

    def release(self, scan: UUID, run: int) -> None:
        """Kill what still runs, and free this worker's disk."""
        child = self.running.pop((scan, run), None)
        if child is not None:
            child.stop()
        shutil.rmtree(self._folder(scan).root.parent, ignore_errors=True)

    def _folder(self, scan: UUID) -> ScanFolder:
        return ScanFolder(self.work / str(scan) / "scan")

    def _prepare(self, scan: UUID) -> Job:
        """Download photos, earlier results and the reference to this worker's disk."""
        with self.database.reading() as session:
            row = session.get_one(Scan, scan)
            reference, part, colours = row.reference_id, row.part, row.colours
            distance, is_edited = row.distance, session.get(ScanEdits, scan) is not None
            usable = select(Photo).where(Photo.scan_id == scan, Photo.state == "usable")
            photos = list(session.scalars(usable.order_by(Photo.created_at, Photo.id)))
        folder = self._folder(scan)
        sources = folder.root.parent / "photos"
        for number, photo in enumerate(photos, start=1):
            path = sources / f"{number:04d}{suffix_of(photo.name)}"
            if not path.exists():
                self.store.fetch(photo.original, path)
        download_scan(self.store, scan, folder)
        if not is_edited:  # the edits of an earlier run were for its coordinates
            folder.edits.unlink(missing_ok=True)
        words = distance_settings(distance, folder.root.parent / "points.toml") if distance else []
        if reference is not None:
            before = ScanFolder(folder.root.parent / "reference")
            download_scan(self.store, reference, before)
            words += rescan_settings(before.root, part, colours)
        words += self._own_network(scan, folder.root.parent / "network.onnx")
        words.append("export.ar_files=true")
        config = str(self.settings.scan_settings or "")
        return Job(str(sources), str(folder.root), config, words)

    def _own_network(self, scan: UUID, path: Path) -> list[str]:
        """Fetch the gym's own network, note it in the scan, and return the settings that use it."""
        with self.database.writing() as session:
            network = network_of(session, gym_of(session, scan))
            session.get_one(Scan, scan).network = None if network is None else network.result
            key = "" if network is None else network.key
        if not key:
            return []
        self.store.fetch(key, path)
        return [f"detect.model={json.dumps(str(path.absolute()))}"]

    def _tell(self, scan: UUID, run: int, state: object) -> bool:
        """Store the progress; return False if the scan shall not go on."""
        with self.database.reading() as session:
            row = session.get(Scan, scan)
            if row is None or row.run != run or row.state != State.RUNNING:
                return False
        if isinstance(state, tuple):
            step, done, notes = state
            row_now = ScanProgress(
                scan_id=scan,
                stage=step.stage,
                doing=step.doing[:200],
                done=done,
                total=step.total,
                notes=list(notes),
                at=now(),
            )
            with self.database.writing() as session:
                if session.get(Scan, scan) is not None:
                    session.merge(row_now)
        return True


def rescan_settings(reference: Path, part: bool, colours: Sequence[str]) -> list[str]:
    """Return the settings `section.key=value` of a scan in the frame of a reference.

    Parameters
    ----------
    reference : scan folder; part, colours : see `Scan`.
    """
    words = [f"sparse.reference={json.dumps(str(reference.absolute()))}"]
    if part:
        listed = json.dumps(",".join(colours), ensure_ascii=False)
        words += ["sparse.part=true", f"sparse.part_colours={listed}"]
    return words


def failure_message(failure: Failed) -> str:
    """Return a failure as a step's result, which DBOS stores."""
    return json.dumps({"message": failure.message, "hint": failure.hint, "defect": failure.defect})


def _scale_of(folder: ScanFolder) -> dict[str, object]:
    """Return where the metres of a scan come from, for `Scan.scale`."""
    scale = Scale.load(folder.scale)
    plates = [plate.label for plate in scale.plates if plate.used]
    return {"method": scale.method, "metric": scale.metric, "plates": plates}
