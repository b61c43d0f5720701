"""Runs that make a backup at the target or try one again: daily, or when an operator wants it.

A run is a job. Its row has the progress while it runs, and the reason if it fails; the backups
themselves are listed at the target, which outlives the server.
"""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import Final, Literal
from uuid import UUID, uuid4

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo.core import EnvironmentLacksError, WalltopoError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.mails import mail_templates
from walltopo_gym.accounts.models import Person
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database, take_turn
from walltopo_gym.errors import ConflictError
from walltopo_gym.jobs.queue import Failure, Job, enqueue, reason_of
from walltopo_gym.mail import Mail, Mailer
from walltopo_gym.operating.backup import write_backup
from walltopo_gym.operating.backup_target import (
    BackupFacts,
    BackupTarget,
    StoredBackup,
    backup_name,
    open_target,
)
from walltopo_gym.operating.backup_trial import Trial, compare_restored
from walltopo_gym.operating.restored import OPEN_STATES, server_id
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.scans.running import WorkerStopsError
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, private_folder
from walltopo_gym.storage.models import BackupRun

BACKUPS: Final = Job("backups", at_once=1, of_one_gym=None, waits=(600, 3600))
ALERTS: Final = Job("backup-alerts", at_once=1, of_one_gym=None)
Kind = Literal["make", "try", "restore"]
_EVERY_S: Final = 1.0  # between two notes of the progress
_KEPT: Final = timedelta(days=90)


def new_backup_name(database: Database) -> str:
    """Return the name of a backup that this server begins now."""
    return backup_name(server_id(database), now())


def queue_run(session: Session, kind: Kind, name: str, *, by: UUID | None = None) -> BackupRun:
    """Queue a run.

    Parameters
    ----------
    name : of the backup. by : the operator; None: by schedule.

    Raises
    ------
    ConflictError : a run waits or is at work.
    """
    take_turn(session, "backup runs")
    if open_run(session) is not None:
        raise ConflictError("upkeep-busy", "upkeep-wait")
    row = _new_run(kind, name)
    session.add(row)
    log_change(session, f"backup.{kind}", person=by, subject=row.name)
    enqueue(session, BACKUPS, str(row.id), gym="")
    return row


def _new_run(kind: Kind, name: str) -> BackupRun:
    return BackupRun(id=uuid4(), created_at=now(), kind=kind, name=name)


def add_ended_run(
    session: Session, kind: Kind, name: str, error: str, *, by: UUID | None = None
) -> None:
    """Add the row of a run that was not queued and ended now.

    Parameters
    ----------
    error : empty if it succeeded. by : the operator, if a restored backup has the account.
    """
    row = _new_run(kind, name)
    _end_run(session, row, error)
    session.add(row)
    person = None if by is None or session.get(Person, by) is None else by
    log_change(session, f"backup.{kind}", person=person, subject=name, error=error[:200])


def _end_run(session: Session, row: BackupRun, error: str) -> None:
    """End a run; queue a mail about a failed backup unless the one before failed, too."""
    before = select(BackupRun.state).where(
        BackupRun.ended_at.is_not(None), BackupRun.kind != "restore"
    )
    failed_before = session.scalar(before.order_by(BackupRun.ended_at.desc()).limit(1)) == "failed"
    row.state, row.error, row.ended_at = "failed" if error else "done", error[:500], now()
    if error and row.kind != "restore" and not failed_before:
        enqueue(session, ALERTS, str(row.id), gym="")


def open_run(session: Session) -> BackupRun | None:
    """Return the run that waits or is at work."""
    return session.scalar(
        select(BackupRun)
        .where(BackupRun.state.in_(OPEN_STATES))
        .order_by(BackupRun.created_at)
        .limit(1)
    )


def last_run(session: Session) -> BackupRun | None:
    """Return the run that ended last."""
    ended = select(BackupRun).where(BackupRun.ended_at.is_not(None))
    return session.scalar(ended.order_by(BackupRun.ended_at.desc()).limit(1))


@dataclass(frozen=True)
class BackupRuns:
    """The chore that queues the daily run, and the jobs of runs and of mails about failed ones."""

    settings: GymSettings
    database: Database
    store: FileStore
    mailer: Mailer
    stopping: threading.Event = field(default_factory=threading.Event)

    def queue_daily(self) -> None:
        """Queue the daily backup, unless a run waits or is at work."""
        name = new_backup_name(self.database)
        with self.database.writing() as session:
            if open_run(session) is None:
                queue_run(session, "make", name)

    def run(self, run: str) -> None:
        """Carry out a queued run.

        Raises
        ------
        WalltopoError : as in `carry_out`.
        """
        row = self._begin(UUID(run))
        if row is not None:
            self.carry_out(row)
            self._end(row.id)

    def carry_out(self, row: BackupRun) -> None:
        """Make a backup and try it, or try one again; delete old ones after an equal new one.

        Raises
        ------
        EnvironmentLacksError : the restored gym differs from the backup's list.
        InputError, SettingsError, ConflictError : as in `open_target` and `try_backup`.
        """
        target, server = open_target(self.settings), server_id(self.database)
        folder = target.work_folder(self.settings, server)
        with lock_data_folder(self.settings.data), work_folder(folder) as work:
            there = target.get(row.name) if row.kind == "make" else target.find(row.name)
            # A run that was killed after it stored its backup goes on with the trial.
            if there is None or (row.kind == "make" and there.facts and not there.is_equal):
                self._write(target, work, row)
            trial = self._try(target, work, row)
            if trial.is_equal and row.kind == "make":
                target.drop_old(server, row.name, self.settings.backups_kept)
        if not trial.is_equal:
            raise EnvironmentLacksError(f"{row.name} is not equal: {trial.differences[0]}")

    def _begin(self, run: UUID) -> BackupRun | None:
        """Mark a run as at work; return None if it is gone or has ended."""
        with self.database.writing() as session:
            session.execute(delete(BackupRun).where(BackupRun.ended_at < now() - _KEPT))
            row = session.get(BackupRun, run)
            if row is None or row.ended_at is not None:
                return None
            row.state = "running"
        return row

    def _write(self, target: BackupTarget, work: Path, row: BackupRun) -> None:
        file = work / row.name
        report = self._progress(row.id, "writing")
        write_backup(self.settings, self.database, self.store, file, report)
        self._progress(row.id, "storing")(0, 0)
        target.receive(file)
        file.unlink(missing_ok=True)

    def _try(self, target: BackupTarget, work: Path, row: BackupRun) -> Trial:
        """Try a backup and store the result beside it."""
        report = self._progress(row.id, "trying")
        report(0, 0)
        with target.local_copy(row.name, work) as file:
            trial = compare_restored(self.settings, file, report)
        target.save_facts(row.name, _backup_facts(trial, target.find(row.name)))
        return trial

    def _progress(self, run: UUID, step: str) -> Callable[[int, int], None]:
        """Return a function that notes the progress of a step, at most every second.

        Raises
        ------
        WorkerStopsError : the worker stops; the job begins again with the next one.
        """
        last = 0.0

        def note(done: int, total: int) -> None:
            nonlocal last
            if self.stopping.is_set():
                raise WorkerStopsError
            if time.monotonic() < last + _EVERY_S:
                return
            last = time.monotonic()
            with self.database.writing() as session:
                row = session.get(BackupRun, run)
                if row is not None:
                    row.step, row.done, row.total = step, done, total

        return note

    def _end(self, run: UUID) -> None:
        with self.database.writing() as session:
            row = session.get(BackupRun, run)
            if row is not None:
                _end_run(session, row, "")

    def send_alert(self, run: str) -> None:
        """Mail the operators about a failed run.

        Raises
        ------
        OSError : the mail server refused it.
        """
        with self.database.reading() as session:
            row = session.get(BackupRun, UUID(run))
            wanted = select(Person.email).where(Person.operator, Person.locked_at.is_(None))
            addresses = session.scalars(wanted.order_by(Person.email)).all()
        if row is None:
            return
        template = mail_templates()["en"]["backup-failed"]
        lines = [template["text"].replace("{error}", row.error)]
        lines.append(f"{self.settings.link_base}/operator/backups")
        for address in addresses:
            self.mailer.hand_over(Mail(address, template["subject"], "\n\n".join(lines) + "\n"))


def run_now(runs: BackupRuns, kind: Kind, name: str = "") -> str:
    """Carry out a run in this process, without a worker; return the backup's name.

    Parameters
    ----------
    name : (try) of the backup.

    Raises
    ------
    WalltopoError : as in `BackupRuns.carry_out`.
    """
    row, error = _new_run(kind, name or new_backup_name(runs.database)), "interrupted"
    try:
        runs.carry_out(row)
        error = ""
    except WalltopoError as why:
        error = reason_of(why)
        raise
    finally:
        with runs.database.writing() as session:
            add_ended_run(session, kind, row.name, error)
    return row.name


def record_failure(session: Session, failure: Failure, run: str) -> None:
    """Write down why a try of a run failed; end the run after its last one."""
    row = session.get(BackupRun, UUID(run))
    if row is None:
        return
    if failure.again_at is not None:
        row.state, row.error = "waiting", failure.error[:500]
    else:
        _end_run(session, row, failure.error)


def _backup_facts(trial: Trial, found: StoredBackup) -> BackupFacts:
    """Return the facts about a backup after its trial."""
    return BackupFacts(
        made_at=trial.made_at or found.stored_at,
        version=trial.version,
        rows=trial.rows,
        tables=trial.tables,
        files=trial.files,
        has_tables=trial.has_tables,
        tried_at=now(),
        differences=trial.differences,
    )


@contextmanager
def work_folder(folder: Path) -> Iterator[Path]:
    """Yield an empty folder for unfinished backups; one that a killed run left is removed."""
    shutil.rmtree(folder, ignore_errors=True)
    try:
        yield private_folder(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
