"""A scan's job: a durable workflow whose steps are the scan's stages.

DBOS stores each step's result; a workflow whose worker died resumes after the last stored step,
here or on another worker.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from functools import wraps
from typing import Final, ParamSpec, TypeVar
from uuid import UUID

from dbos import DBOS
from sqlalchemy import update
from sqlalchemy.exc import InterfaceError, OperationalError
from sqlalchemy.orm import Session

from walltopo_gym.errors import ConflictError
from walltopo_gym.jobs.queue import Failure
from walltopo_gym.scans.job import Failed
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.queues import scan_finished
from walltopo_gym.scans.running import WorkerStopsError
from walltopo_gym.scans.service import State
from walltopo_gym.scans.stages import ScanSteps, failure_message

P = ParamSpec("P")
T = TypeVar("T")

_LOG = logging.getLogger("walltopo_gym.scans")
_POLL_S: Final = 1.0
_AWAY_S: Final = 3600  # for so long a step waits for a database that is away


class ScanJobs:
    """The durable workflows of scans."""

    def __init__(self, steps: ScanSteps) -> None:
        self._steps = steps

    def run_scan(self, scan: str, run: int) -> None:
        """Run one scan from its photos to the review."""
        one = UUID(scan)
        try:
            if not DBOS.run_step({"name": "claim"}, self._patient(self._steps.claim), one, run):
                return
            why = ""
            for stage in self._patient(self._steps.names)(one):
                make = self._patient(self._steps.stage)
                why = DBOS.run_step({"name": stage}, make, one, run, stage)
                if why:
                    break
            if not why:
                DBOS.run_step({"name": "finish"}, self._finish, one, run)
        except Exception as error:  # the store is away, its files are damaged: nobody waits for it
            _LOG.exception("scan %s, run %s", scan, run)
            why = failure_message(Failed(f"{type(error).__name__}: {error}", "", defect=True))
        if why:
            DBOS.run_step({"name": "fail"}, self._patient(self._steps.fail), one, run, why)
        self._steps.release(one, run)

    def _finish(self, scan: UUID, run: int) -> None:
        try:
            self._patient(self._steps.finish)(scan, run)
        except ConflictError as why:  # cancelled or deleted at the last moment
            _LOG.info("scan %s, run %s: not handed over (%s)", scan, run, why)

    def _patient(self, step: Callable[P, T]) -> Callable[P, T]:
        """Return a step that waits while the database is away. Each step may be repeated and
        resumes where its child process is by then."""

        @wraps(step)
        def seen_through(*args: P.args, **words: P.kwargs) -> T:
            deadline = time.monotonic() + _AWAY_S
            while True:
                try:
                    return step(*args, **words)
                except (OperationalError, InterfaceError) as error:
                    if time.monotonic() > deadline:
                        raise
                    _LOG.warning("the database does not answer, the scan waits: %s", error)
                    if self._steps.stopping.wait(_POLL_S):
                        raise WorkerStopsError from error

        return seen_through


def record_failure(session: Session, failure: Failure, scan: str, run: int) -> None:
    """Mark a scan as failed because every worker that ran it died."""
    at_work = Scan.state.in_((State.QUEUED, State.RUNNING))
    change = update(Scan).where(Scan.id == UUID(scan), Scan.run == run, at_work)
    found = session.scalar(
        change.values(
            state=State.FAILED,
            error="the scan failed by a fault of the program",
            hint="The operator's log has it.",
        ).returning(Scan.id)
    )
    if found is not None:
        scan_finished(session, found, failed=True)
