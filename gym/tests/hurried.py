"""A worker in the tests' own process that loses no time between two tries."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any

from gym.tests.running import wait_for
from gym.tests.worlds import Server

from walltopo_gym.jobs.queue import Task
from walltopo_gym.jobs.worker import run_jobs
from walltopo_gym.jobs.worker_slot import WorkerSlot

_WAITING = ["ENQUEUED", "DELAYED", "PENDING"]


@contextmanager
def at_work(server: Server, *tasks: Task) -> Iterator[None]:
    """Run the tasks' jobs for as long as the block lasts."""
    hurried = [
        replace(task, job=replace(task.job, waits=(0.0,) * len(task.job.waits), poll_s=0.05))
        for task in tasks
    ]
    slot = WorkerSlot(server.settings, server.database)
    with slot, run_jobs(server.database, slot, hurried):
        yield


def do_all(server: Server, *tasks: Task) -> None:
    """Run the tasks' jobs until none waits."""
    names = {task.job.name for task in tasks}
    with at_work(server, *tasks):
        wait_for(lambda: not waiting(server, *names))


def do_now(server: Server, *tasks: Task) -> None:
    """Run once what is queued of the tasks' jobs, without a worker; what fails stays queued."""
    runs = {task.job.name: task.run for task in tasks}
    rows = server.database.jobs.list_workflows(status=["ENQUEUED", "DELAYED"], name=list(runs))
    for row in rows:
        assert row.input is not None
        with suppress(Exception):
            runs[row.name](*row.input["args"][1:])
            server.database.jobs.delete_workflow(row.workflow_id)


def waiting(server: Server, *names: str) -> list[Any]:
    """Return what of these jobs is queued or runs: the arguments of each."""
    rows = server.database.jobs.list_workflows(status=_WAITING, name=list(names))
    return [row.input["args"][1:] for row in rows if row.input]


def forget_jobs(server: Server) -> None:
    """Forget the jobs of the tests before."""
    rows = server.database.jobs.list_workflows(load_input=False, load_output=False)
    server.database.jobs.delete_workflows([row.workflow_id for row in rows])
