"""Jobs: queued with the change that asks for them, tried a bounded number of times, taken over."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from gym.tests.hurried import do_all, forget_jobs, waiting
from gym.tests.running import wait_for
from gym.tests.worlds import Server
from sqlalchemy import text
from sqlalchemy.exc import OperationalError

from walltopo_gym.clock import now
from walltopo_gym.jobs import running, worker
from walltopo_gym.jobs.queue import Failure, Job, NotYetError, Task, enqueue
from walltopo_gym.jobs.worker import Chore, delete_old_jobs, keep_slot, run_jobs
from walltopo_gym.jobs.worker_slot import WorkerSlot, count_living_workers
from walltopo_gym.operating.jobs import job_lines

pytestmark = pytest.mark.both_databases("queues and locks")

JOB = Job("test-job", waits=(60.0, 60.0))
GYM = uuid4()

# A worker that ends in the middle of job 1, and runs any other one.
DEADLY = """
import os, sys, time
from walltopo_gym.database.engine import Database
from walltopo_gym.jobs import running, worker
from walltopo_gym.jobs.worker_slot import WorkerSlot
from walltopo_gym.jobs.queue import Job, Task
from walltopo_gym.jobs.worker import run_jobs
from walltopo_gym.settings import load_settings

def run(number):
    print(number, flush=True)
    if number == 1:
        os._exit(9)
    if number == 2:
        time.sleep(600)

settings = load_settings({"data": sys.argv[1], "database": sys.argv[2]}, {})
database = Database(settings.database_url)
job = Job("test-job", waits=(0.0, 0.0), poll_s=0.05)
with WorkerSlot(settings, database) as slot, run_jobs(database, slot, [Task(job, run)]):
    sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def _no_jobs(server: Server) -> None:
    forget_jobs(server)


def put(server: Server, *numbers: int, job: Job = JOB) -> None:
    with server.database.writing() as session:
        for number in numbers:
            enqueue(session, job, number, gym=GYM)


@contextmanager
def elsewhere(server: Server) -> Iterator[subprocess.Popen[str]]:
    """A worker in a process of its own."""
    words = [sys.executable, "-c", DEADLY, str(server.settings.data), server.settings.database]
    child = subprocess.Popen(
        words,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ,
        cwd=Path(__file__).parents[3],
    )
    try:
        yield child
    finally:
        child.kill()
        child.communicate()


def aside(server: Server) -> list[str]:
    """Return what the operator reads about jobs that were given up."""
    return [line for line in job_lines(server.database) if "set aside" in line]


def test_a_job_is_queued_with_its_transaction_or_not_at_all(server: Server) -> None:
    with server.database.writing() as session:
        enqueue(session, JOB, 1, gym=GYM)
        session.rollback()
    assert waiting(server, JOB.name) == []
    put(server, 2)
    assert waiting(server, JOB.name) == [(2,)]


def test_a_key_is_queued_once(server: Server) -> None:
    for number in range(3):
        with server.database.writing() as session:
            enqueue(session, JOB, number, gym=GYM, key="test-job-key")
    assert waiting(server, JOB.name) == [(0,)]


def test_a_job_that_fails_is_tried_again_and_set_aside(server: Server) -> None:
    tried: list[int] = []
    noted: list[Failure] = []

    def run(number: int) -> None:
        tried.append(number)
        if number == 1:
            raise ValueError("poison")

    put(server, 1, 2)
    do_all(server, Task(JOB, run, lambda _, failure, __: noted.append(failure)))
    assert sorted(tried) == [1, 1, 1, 2]
    assert [failure.tries for failure in noted] == [1, 2, 3]
    assert [failure.again_at is None for failure in noted] == [False, False, True]
    assert all("poison" in failure.error for failure in noted)
    assert not any("poison" in failure.shown for failure in noted)  # the gym reads it
    (line,) = aside(server)
    assert line == "1 set aside test-job: ValueError: poison (3 tries)"


def test_a_failure_is_written_down_when_the_database_is_there_again(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, away = running._write_failure, iter([True, False, True, False, False])

    def write_later(*words: Any) -> None:
        if next(away):
            raise OperationalError("away", None, OSError())
        write(*words)

    def run(_: int) -> None:
        raise ValueError("poison")

    monkeypatch.setattr(running, "_write_failure", write_later)
    monkeypatch.setattr(running, "_AWAY_S", 0.01)
    put(server, 1)
    do_all(server, Task(JOB, run))
    assert aside(server) == ["1 set aside test-job: ValueError: poison (3 tries)"]


def test_a_job_that_waits_for_its_next_try_holds_no_place(server: Server) -> None:
    """One at a time, and the first one fails: the second one does not wait for its next try."""
    done = threading.Event()

    def run(number: int) -> None:
        if number == 1:
            raise ValueError("poison")
        done.set()

    job = Job("test-job", at_once=1, of_one_gym=1, waits=(3600.0,), poll_s=0.05)
    put(server, 1, 2, job=job)
    slot = WorkerSlot(server.settings, server.database)
    with slot, run_jobs(server.database, slot, [Task(job, run)]):
        wait_for(done.is_set)
        wait_for(lambda: waiting(server, job.name) == [(1,)])


def test_what_cannot_be_done_yet_is_no_try(server: Server) -> None:
    tried: list[int] = []

    def run(number: int) -> None:
        tried.append(number)
        if len(tried) < 6:
            raise NotYetError(now() - timedelta(seconds=1))

    put(server, 1)
    do_all(server, Task(JOB, run))
    assert tried == [1] * 6
    assert aside(server) == []


@pytest.mark.slow
def test_a_job_that_kills_its_worker_is_set_aside(server: Server) -> None:
    put(server, 1)
    for _ in range(JOB.max_tries):
        with elsewhere(server) as child:
            assert child.wait(timeout=600) == 9
    put(server, 3)
    with elsewhere(server):
        wait_for(lambda: not waiting(server, JOB.name))
    assert aside(server) == ["1 set aside test-job: the worker ended during the last try (4 tries)"]


def test_the_jobs_of_a_killed_worker_go_on_here(server: Server) -> None:
    """Within seconds, and only when it is gone."""
    put(server, 2)
    done, stop = threading.Event(), threading.Event()
    with elsewhere(server) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "2\n"
        slot = WorkerSlot(server.settings, server.database)
        with slot, run_jobs(server.database, slot, [Task(JOB, lambda _: done.set())]):
            assert count_living_workers(server.settings, server.database) == 2
            slot.recover()
            assert not done.wait(3)  # that one lives
            watcher = threading.Thread(target=keep_slot, args=(slot, stop, lambda _: None))
            watcher.start()
            child.send_signal(signal.SIGKILL)
            assert done.wait(60)
            stop.set()
            watcher.join()
    # PostgreSQL frees a lock a moment after its connection has been closed.
    wait_for(lambda: count_living_workers(server.settings, server.database) == 0)


def test_a_worker_whose_lock_was_lost_keeps_what_is_still_its_own(server: Server) -> None:
    if server.database.is_sqlite:
        pytest.skip("a lock of a file is lost with its process alone")
    with WorkerSlot(server.settings, server.database) as slot:
        kept: list[set[str]] = []
        slot.hold(kept.append)
        assert kept == []
        end = text("SELECT pg_terminate_backend(pid) FROM pg_locks WHERE locktype = 'advisory'")
        with server.database.writing() as session:
            session.execute(end)
        wait_for(lambda: count_living_workers(server.settings, server.database) == 0)
        slot.hold(kept.append)
        assert kept == [set()]
        assert count_living_workers(server.settings, server.database) == 1


@pytest.mark.slow
def test_a_chore_runs_by_the_clock_until_it_is_none(server: Server) -> None:
    done = threading.Event()
    slot = WorkerSlot(server.settings, server.database)
    chore = Chore("test-chore", "* * * * * *", done.set)
    with slot, run_jobs(server.database, slot, [], [chore]):
        wait_for(done.is_set)
        assert [row["schedule_name"] for row in server.database.jobs.list_schedules()] == [
            "test-chore"
        ]
    with slot, run_jobs(server.database, slot, []):
        assert server.database.jobs.list_schedules() == []


def test_what_ended_long_ago_is_forgotten(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    put(server, 1)
    do_all(server, Task(JOB, lambda _: None))
    put(server, 2)
    ended = server.database.jobs.list_workflows
    delete_old_jobs(server.database)
    assert len(ended(status="SUCCESS", name=JOB.name)) == 1  # not long ago
    monkeypatch.setattr(worker, "_KEPT", {"SUCCESS": timedelta(days=-1)})
    delete_old_jobs(server.database)
    assert ended(status="SUCCESS", name=JOB.name) == []
    assert waiting(server, JOB.name) == [(2,)]
