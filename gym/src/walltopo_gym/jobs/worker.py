"""A worker: DBOS with the declared tasks and chores, for the duration of a block."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from dbos import DBOS, DBOSConfig

from walltopo_gym.clock import now
from walltopo_gym.database.engine import APPLICATION, Database
from walltopo_gym.jobs.heartbeat import Heartbeat
from walltopo_gym.jobs.queue import Task
from walltopo_gym.jobs.running import open_queue, register_job
from walltopo_gym.jobs.worker_slot import WorkerSlot

_LOG = logging.getLogger("walltopo_gym.jobs")
# Raised when a job changes so that a workflow cannot go on under the new one.
_SHAPE: Final = "1"
_LAST_WORDS_S: Final = 5  # for writing down what has just ended; what runs is let go of at once
_LOOK_S: Final = 1.0
# So long DBOS keeps what is done, and what was set aside.
_KEPT: Final = {
    "SUCCESS": timedelta(days=1),
    "CANCELLED": timedelta(days=1),
    "ERROR": timedelta(days=30),
    "MAX_RECOVERY_ATTEMPTS_EXCEEDED": timedelta(days=30),
}
_TOGETHER: Final = 500


@dataclass(frozen=True)
class Chore:
    """A scheduled task that one of all workers runs.

    Parameters
    ----------
    name : of the workflow and of its schedule; at : a crontab line, UTC.
    """

    name: str
    at: str
    run: Callable[[], object]


@contextmanager
def run_jobs(
    database: Database, slot: WorkerSlot, tasks: Sequence[Task], chores: Sequence[Chore] = ()
) -> Iterator[None]:
    """Run jobs and chores in this process for the duration of the block."""
    config: DBOSConfig = {
        "name": APPLICATION,
        "system_database_url": database.url,
        "executor_id": slot.name,
        "application_version": _SHAPE,
        "log_level": "WARNING",
        "enable_otlp": False,
        "run_migrations": False,  # `migrations.run` did
    }
    DBOS(config=config)
    try:
        for task in tasks:
            register_job(database, task)
        schedules = {chore.name: (chore.at, _scheduled(chore)) for chore in chores}
        DBOS.listen_queues([task.job.name for task in tasks])
        DBOS.launch()
        for task in tasks:
            open_queue(task)
        _keep_schedules(schedules)
        yield
    finally:
        # The registry goes, too: the next worker in this process registers its own workflows.
        DBOS.destroy(destroy_registry=True, workflow_completion_timeout_sec=_LAST_WORDS_S)


def keep_slot(
    slot: WorkerSlot, stop: threading.Event, regained: Callable[[set[str]], None]
) -> None:
    """Hold this worker's slot until `stop`, give signs of life, and restart the jobs of dead
    workers."""
    heart = Heartbeat(slot.database, slot.name)
    while not stop.wait(_LOOK_S):
        try:
            slot.hold(regained)
            slot.recover()
            heart.beat()
        except Exception:  # a database that is away for a while shall not end the worker
            _LOG.exception("the worker goes on")
    heart.end()


def delete_old_jobs(database: Database) -> None:
    """Delete jobs that ended long ago."""
    for status, age in _KEPT.items():
        before = (now() - age).isoformat()
        while ended := database.jobs.list_workflows(
            status=status,
            completed_before=before,
            limit=_TOGETHER,
            load_input=False,
            load_output=False,
        ):
            database.jobs.delete_workflows([workflow.workflow_id for workflow in ended])


def _scheduled(chore: Chore) -> Callable[[datetime, object], None]:
    @DBOS.workflow(name=chore.name)
    def workflow(at: datetime, context: object) -> None:
        chore.run()

    return workflow


def _keep_schedules(
    schedules: Mapping[str, tuple[str, Callable[[datetime, object], None]]],
) -> None:
    """Set the schedules to exactly these; those of disabled features are deleted."""
    for row in DBOS.list_schedules():
        if row["schedule_name"] not in schedules:
            DBOS.delete_schedule(row["schedule_name"])
    DBOS.apply_schedules(
        [
            {"schedule_name": name, "workflow_fn": run, "schedule": at}
            for name, (at, run) in schedules.items()
        ]
    )
