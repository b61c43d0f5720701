"""Run jobs: each try is a workflow of DBOS; a retry is queued with a delay, so it holds no slot
while it waits.

A job whose worker was killed is restarted (`worker_slot.py`). Restarts count as tries, so that an
item that kills its worker is set aside, too.
"""

from __future__ import annotations

import logging
import time
from typing import Final

from dbos import DBOS, WorkflowStatus
from sqlalchemy.exc import InterfaceError, OperationalError

from walltopo.core import WalltopoError
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.jobs.queue import (
    Failure,
    InterruptedTryError,
    NotYetError,
    Task,
    enqueue,
    failure_of,
)

_LOG = logging.getLogger("walltopo_gym.jobs")
_AWAY_S: Final = 1.0
_KILLED: Final = "the worker ended during the last try"


class SetAsideError(Exception):
    """An item failed in all tries; DBOS keeps this error for the operator."""


def register_job(database: Database, task: Task) -> None:
    """Declare a job's workflow to DBOS before DBOS is launched."""

    @DBOS.workflow(name=task.job.name)
    def workflow(tries: int, *args: str | int) -> None:
        run_once(database, task, tries, *args)


def open_queue(task: Task) -> None:
    """Declare a job's queue to DBOS after DBOS is launched."""
    job = task.job
    DBOS.register_queue(
        job.name,
        worker_concurrency=job.at_once,
        partition_worker_concurrency=job.of_one_gym,
        polling_interval_sec=job.poll_s,
        on_conflict="always_update",
    )


def run_once(database: Database, task: Task, tries: int, *args: str | int) -> None:
    """Try a job; on a failure, queue its next try.

    Raises
    ------
    SetAsideError : that was the last try.
    """
    assert DBOS.workflow_id is not None, "a job runs in a workflow"
    # DBOS's own call would be kept as a step, and its answer given again after a kill.
    status = database.jobs.retrieve_workflow(DBOS.workflow_id).get_status()
    begun = tries + max(1, (status.recovery_attempts or 1) - task.job.restarts)
    try:
        if begun > task.job.max_tries:
            raise InterruptedTryError(_KILLED)
        task.run(*args)
    except NotYetError as later:
        _end_try(database, task, status, tries, later, args)
    except Exception as error:
        is_known = isinstance(error, WalltopoError | OSError | InterruptedTryError)
        failure = failure_of(task.job, begun, error)
        _LOG.warning(
            "%s %s: %s", task.job.name, args, failure.error, exc_info=None if is_known else error
        )
        _end_try(database, task, status, begun, failure, args)
        if failure.again_at is None:
            raise SetAsideError(f"{failure.error} ({begun} tries)") from None


def _end_try(
    database: Database,
    task: Task,
    status: WorkflowStatus,
    tries: int,
    why: Failure | NotYetError,
    args: tuple[str | int, ...],
) -> None:
    """Write a failure as `_write_failure` does, waiting for the database if it is away."""
    while True:
        try:
            _write_failure(database, task, status, tries, why, args)
        except (OperationalError, InterfaceError) as error:
            _LOG.warning("the database does not answer, %s waits: %s", task.job.name, error)
            time.sleep(_AWAY_S)
        else:
            return


def _write_failure(
    database: Database,
    task: Task,
    status: WorkflowStatus,
    tries: int,
    why: Failure | NotYetError,
    args: tuple[str | int, ...],
) -> None:
    """Write a failure into the item's row and queue the next try, in one transaction."""
    at = why.at if isinstance(why, NotYetError) else why.again_at
    # The next key follows from this one: a workflow that is run again queues no second try.
    root, _, number = status.workflow_id.partition("/")
    with database.writing() as session:
        if isinstance(why, Failure) and task.note is not None:
            task.note(session, why, *args)
        if at is not None:
            enqueue(
                session,
                task.job,
                *args,
                gym=status.queue_partition_key or "",
                key=f"{root}/{int(number or 1) + 1}",
                priority=status.priority or 1,
                delay=at - now(),
                tries=tries,
            )
