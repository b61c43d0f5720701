"""A worker with all of its tasks and chores."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from uuid import UUID

from walltopo_gym.climbing.counting import RECOUNTS, recount_gym
from walltopo_gym.database.engine import Database
from walltopo_gym.features import features_on
from walltopo_gym.jobs.queue import Task
from walltopo_gym.jobs.worker import Chore, delete_old_jobs, keep_slot, run_jobs
from walltopo_gym.jobs.worker_slot import WorkerSlot
from walltopo_gym.mail import make_mailer
from walltopo_gym.operating import backup_runs
from walltopo_gym.operating.backup_runs import ALERTS, BACKUPS, BackupRuns
from walltopo_gym.operating.storage_use import measure_storage
from walltopo_gym.publishing import moves, plans
from walltopo_gym.publishing.moves import SuggestedMoves
from walltopo_gym.scans import overlap, own_network, photo_checks
from walltopo_gym.scans import worker as scans
from walltopo_gym.scans.overlap import Overlaps
from walltopo_gym.scans.own_network import OwnNetworks
from walltopo_gym.scans.photo_checks import PhotoChecks
from walltopo_gym.scans.queues import BATCHES, MOVES, OVERLAPS, PHOTOS, SCANS
from walltopo_gym.scans.stages import ScanSteps
from walltopo_gym.scans.worker import ScanJobs
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.zones import PUBLICATIONS


def work(
    settings: GymSettings, database: Database, store: FileStore, stop: threading.Event
) -> None:
    """Work until `stop`; running scans resume when a worker starts again."""
    with WorkerSlot(settings, database) as slot:
        steps = ScanSteps(settings, database, store, settings.data / "work" / slot.name)
        tasks = tasks_of(steps)
        moves.queue_missing(database)
        for feature in features_on(settings):
            feature.start(database)
        with run_jobs(database, slot, tasks, chores_of(steps)):
            try:
                keep_slot(slot, stop, steps.keep)
            finally:
                steps.stop()


def tasks_of(steps: ScanSteps) -> list[Task]:
    """Return the tasks of queued jobs, without those of disabled features."""
    settings, database, store = steps.settings, steps.database, steps.store
    checks = PhotoChecks(database, store)
    tasks = [
        Task(
            replace(SCANS, at_once=max(1, settings.workers)),
            ScanJobs(steps).run_scan,
            scans.record_failure,
        ),
        Task(BATCHES, checks.check_batch),
        Task(PHOTOS, checks.check, photo_checks.record_failure),
        Task(OVERLAPS, Overlaps(database, store).answer, overlap.record_failure),
        Task(MOVES, SuggestedMoves(database, store).suggest, moves.record_failure),
        Task(
            PUBLICATIONS, lambda gym: plans.publish_due(database, UUID(gym)), plans.record_failure
        ),
        Task(RECOUNTS, lambda gym: recount_gym(database, UUID(gym))),
    ]
    backups = _backups(steps)
    tasks += [
        Task(BACKUPS, backups.run, backup_runs.record_failure),
        Task(ALERTS, backups.send_alert),
    ]
    if settings.own_networks:
        tasks.append(
            Task(own_network.TRAININGS, _own_networks(steps).train, own_network.record_failure)
        )
    for feature in features_on(settings):
        tasks += feature.tasks(settings, database, store, steps.stopping)
    return tasks


def _own_networks(steps: ScanSteps) -> OwnNetworks:
    return OwnNetworks(steps.settings, steps.database, steps.store, steps.stopping)


def _backups(steps: ScanSteps) -> BackupRuns:
    mailer = make_mailer(steps.settings)
    return BackupRuns(steps.settings, steps.database, steps.store, mailer, steps.stopping)


def chores_of(steps: ScanSteps) -> list[Chore]:
    """Return the scheduled chores, without those of disabled features."""
    settings, database = steps.settings, steps.database
    chores = [
        Chore("tidy", "17 * * * *", partial(delete_old_jobs, database)),
        Chore("storage-use", "41 * * * *", partial(measure_storage, database, steps.store)),
    ]
    if settings.backup_to:
        daily = _backups(steps).queue_daily
        chores.append(Chore("backups-daily", f"7 {settings.backup_hour} * * *", daily))
    if settings.own_networks:
        chores.append(Chore("own-networks", "23 * * * *", _own_networks(steps).queue_due))
    for feature in features_on(settings):
        chores += feature.chores(settings, database)
    return chores


@contextmanager
def at_work(settings: GymSettings, database: Database, store: FileStore) -> Iterator[None]:
    """Run a worker in a thread of this process for the duration of the block."""
    stop = threading.Event()
    worker = threading.Thread(target=work, args=(settings, database, store, stop), name="worker")
    worker.start()
    try:
        yield
    finally:
        stop.set()
        worker.join()
