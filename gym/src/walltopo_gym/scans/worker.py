"""A worker: takes queued scans and sees them through, with DBOS as its memory.

Each scan is one durable workflow, its steps are the scan's stages. What a step returned is written
down; a workflow whose worker died goes on after the last of them, here or on another worker. DBOS
keeps its tables in the PostgreSQL database (schema `dbos`), or in a SQLite file beside ours: two
programs that write into one SQLite file would wait for each other.

The platform's own table says what is wanted (`queued`, and which run); the workflow's name is the
scan and the run, so that it is begun once however often it is asked for.
"""

from __future__ import annotations

import fcntl
import logging
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import IO, Final, TypeVar
from uuid import UUID

from dbos import DBOS, DBOSConfig, SetEnqueueOptions, SetWorkflowID
from sqlalchemy import select
from sqlalchemy.exc import InterfaceError, OperationalError

from walltopo.pipeline.stages import stage_names
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.scans.job import Failed
from walltopo_gym.scans.models import Scan, Worker
from walltopo_gym.scans.stages import ScanSteps, WorkerStopsError, told
from walltopo_gym.scans.states import State
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import private_folder
from walltopo_gym.uploads.looking import let_go, look_at_all

T = TypeVar("T")

_LOG = logging.getLogger("walltopo_gym.scans")
_QUEUE: Final = "scans"
# Raised when the steps change so that a workflow cannot go on under the new ones.
_SHAPE: Final = "1"
_POLL_S: Final = 1.0
_AT_ONCE: Final = 8  # of what chores put into a queue
_LAST_WORDS_S: Final = 5  # for writing down what has just ended; what runs is let go of at once
_AWAY_S: Final = 3600  # for so long a step waits for a database that is away
_BEATS: Final = 4  # within the silence after which a worker is taken for dead

# DBOS is one for a process, and calls functions: what they work with stands here.
_steps: ScanSteps | None = None


def _at_work() -> ScanSteps:
    assert _steps is not None, "the worker has not begun"
    return _steps


@DBOS.workflow(name="scan")
def scan_workflow(scan: str, run: int) -> str:
    """One scan, from its photos to the review; the state it came to."""
    try:
        if not DBOS.run_step({"name": "claim"}, _claim, scan, run):
            return "not begun"
        why = ""
        for stage in stage_names():
            why = DBOS.run_step({"name": stage}, _stage, scan, run, stage)
            if why:
                break
        if not why:
            DBOS.run_step({"name": "finish"}, _finish, scan, run)
    except Exception as error:  # the store is away, its files are damaged: nobody shall wait for it
        _LOG.exception("scan %s, run %s", scan, run)
        why = told(Failed(f"{type(error).__name__}: {error}", "", defect=True))
    if why:
        DBOS.run_step({"name": "fail"}, _fail, scan, run, why)
    _at_work().release(UUID(scan), run)
    return State.FAILED if why else State.REVIEW


def _claim(scan: str, run: int) -> bool:
    return _seen_through(lambda steps: steps.claim(UUID(scan), run))


def _stage(scan: str, run: int, stage: str) -> str:
    return _seen_through(lambda steps: steps.stage(UUID(scan), run, stage))


def _finish(scan: str, run: int) -> None:
    try:
        _seen_through(lambda steps: steps.finish(UUID(scan), run))
    except ConflictError as why:  # cancelled or deleted at the last moment
        _LOG.info("scan %s, run %s: not handed over (%s)", scan, run, why)


def _fail(scan: str, run: int, why: str) -> None:
    _seen_through(lambda steps: steps.fail(UUID(scan), run, why))


def _seen_through(step: Callable[[ScanSteps], T]) -> T:
    """What a step comes to, though the database goes away meanwhile: each may be done again, and
    goes on where the child is by then."""
    steps = _at_work()
    deadline = time.monotonic() + _AWAY_S
    while True:
        try:
            return step(steps)
        except (OperationalError, InterfaceError) as error:
            if time.monotonic() > deadline:
                raise
            _LOG.warning("the database does not answer, the scan waits: %s", error)
            if steps.stopping.wait(_POLL_S):
                raise WorkerStopsError from error


def run_worker(
    steps: ScanSteps, stop: threading.Event, chores: Sequence[Callable[[], object]] = (),
    queues: Sequence[str] = (),
) -> None:  # fmt: skip
    """Work until `stop`; scans that are being worked on go on when a worker starts again.

    Parameters
    ----------
    chores : done once a round, quickly; queues : of DBOS, that they put work into.
    """
    global _steps
    _steps = steps
    with ExitStack() as held:
        name = held.enter_context(_Place(steps.settings)).name
        # Its own: who was taken for dead and is not may still be at work in another.
        steps.work = steps.work / name
        config: DBOSConfig = {
            "name": "walltopo-gym",
            "system_database_url": jobs_url(steps.settings),
            "executor_id": name,
            "application_version": _SHAPE,
            "log_level": "WARNING",
            "enable_otlp": False,
        }
        DBOS(config=config)
        DBOS.launch()
        held.callback(DBOS.destroy, workflow_completion_timeout_sec=_LAST_WORDS_S)
        held.callback(steps.stop)
        workers = max(1, steps.settings.workers)
        DBOS.register_queue(_QUEUE, worker_concurrency=workers, polling_interval_sec=_POLL_S)
        for queue in queues:
            DBOS.register_queue(queue, worker_concurrency=_AT_ONCE, polling_interval_sec=_POLL_S)
        _work(steps, name, stop, chores)


def jobs_url(settings: GymSettings) -> str:
    """Where DBOS keeps its tables."""
    url = settings.database_url
    if url.startswith("sqlite"):
        return f"sqlite:///{settings.data.absolute() / 'jobs.sqlite'}"
    return url


def _work(
    steps: ScanSteps, name: str, stop: threading.Event, chores: Sequence[Callable[[], object]]
) -> None:
    """Do the chores in rounds; beside them, in threads, the heartbeat and the looks at photos.

    A chore that takes long delays no heartbeat, and a flood of photos delays no chore.
    """
    with steps.database.writing() as session:
        session.merge(Worker(name=name, at=now()))
    database, begun = steps.database, set[str]()
    beat_s = steps.settings.silent_s / _BEATS
    beats = partial(_beat, steps, name), partial(_take_over, steps, name)
    looks = (partial(look_at_all, database, steps.store, name, stop),)
    beside = [
        threading.Thread(target=_repeat, args=(stop, beat_s, beats), name="heartbeat"),
        threading.Thread(target=_repeat, args=(stop, _POLL_S, looks), name="photos"),
    ]
    let_go(database, name)  # what this worker was looking at when it was killed
    for thread in beside:
        thread.start()
    try:
        _repeat(stop, _POLL_S, (partial(begin_queued, database, begun), *chores))
    finally:
        stop.set()
        for thread in beside:
            thread.join()


def _repeat(stop: threading.Event, seconds: float, chores: Sequence[Callable[[], object]]) -> None:
    while not stop.wait(seconds):
        do_chores(chores)


def do_chores(chores: Sequence[Callable[[], object]]) -> None:
    """Do each chore once; one that fails is done again in the next round, after the others."""
    for chore in chores:
        try:
            chore()
        except Exception:  # a database that is away for a while shall not end the worker
            _LOG.exception("the worker goes on")


def begin_queued(database: Database, begun: set[str]) -> None:
    """Hand what is queued to DBOS, once.

    A gym's first scan goes before every other gym's second one, and so on: one that queues ten
    delays nobody but itself. What counts is how many of its scans are before it, at work or queued.
    """
    waiting = (
        select(Scan.id, Scan.run, Scan.state, Wall.gym_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Scan.state.in_((State.QUEUED, State.RUNNING)))
        .order_by(Scan.state.desc(), Scan.created_at)  # those at work first
    )
    with database.reading() as session:
        rows = list(session.execute(waiting))
    before: Counter[UUID] = Counter()
    for scan, run, state, gym in rows:
        before[gym] += 1
        name = f"{scan}-{run}"
        if state == State.QUEUED and name not in begun:
            try:
                with SetWorkflowID(name), SetEnqueueOptions(priority=before[gym]):
                    DBOS.enqueue_workflow(_QUEUE, scan_workflow, str(scan), run)
            except Exception:  # it stays queued in our table, and is handed over in the next round
                _LOG.exception("scan %s, run %s: not handed over", scan, run)
            else:
                begun.add(name)


def _beat(steps: ScanSteps, name: str) -> None:
    """Say that this worker lives. Whose row is gone was taken for dead: others have its scans."""
    with steps.database.writing() as session:
        own = session.get(Worker, name)
        if own is None:
            _LOG.warning("worker %s was silent for too long; others go on with its scans", name)
            steps.abandon()
        session.merge(Worker(name=name, at=now()))


def _take_over(steps: ScanSteps, own: str) -> None:
    """Let the scans of workers that were not heard of for a while go on."""
    silence = timedelta(seconds=steps.settings.silent_s)
    late = select(Worker).where(Worker.at < now() - silence, Worker.name != own)
    gone = []
    # One at a time does this: the row goes when its scans are in the queue again.
    with steps.database.writing() as session:
        for worker in session.scalars(late.with_for_update(skip_locked=True)):
            left = DBOS.list_workflows(status="PENDING", executor_id=worker.name)
            for workflow in left:
                _LOG.warning("worker %s is gone: %s goes on", worker.name, workflow.workflow_id)
                DBOS.resume_workflow(workflow.workflow_id)
            gone.append(worker.name)
            session.delete(worker)
    for name in gone:
        let_go(steps.database, name)


class _Place:
    """A worker's name, the same after a restart and never two workers' at a time: the first free
    of the numbered locks in the data folder."""

    def __init__(self, settings: GymSettings) -> None:
        self._folder: Path = private_folder(settings.data) / "workers"
        self._lock: IO[bytes] | None = None
        self.name = ""

    def __enter__(self) -> _Place:
        self._folder.mkdir(parents=True, exist_ok=True)
        number = 0
        while self._lock is None:
            stream = (self._folder / f"{number}.lock").open("wb")
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                stream.close()
                number += 1
            else:
                self._lock = stream
        self.name = f"{socket.gethostname()}-{number}"
        return self

    def __exit__(self, *_: object) -> None:
        assert self._lock is not None
        self._lock.close()
