"""Background jobs and their queues. A job is queued in the transaction of the change that needs it.

DBOS's tables are in the platform's own database, so a job is a row of the caller's transaction:
committed with it, or rolled back with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Final
from uuid import UUID, uuid4

from sqlalchemy.orm import Session

from walltopo.core import WalltopoError
from walltopo_gym.clock import now

if TYPE_CHECKING:
    from dbos import EnqueueOptions

# Seconds to the next try: about five hours in all, so that a store that is away may come back.
_WAITS: Final = (10, 60, 600, 3600, 14400)
_DEFECT: Final = "a fault of the program; the operator's log says more"


@dataclass(frozen=True)
class Job:
    """A kind of background job, with its own queue.

    Parameters
    ----------
    name : of the workflow and of its queue.
    at_once : maximum number that a worker runs at a time.
    of_one_gym : maximum number per gym, so that none delays another; None: by priority alone.
    waits : seconds before each retry.
    restarts : number of worker deaths during a try until they count as one more try.
    poll_s : seconds between a worker's looks into the queue.
    """

    name: str
    at_once: int = 8
    of_one_gym: int | None = 2
    waits: tuple[float, ...] = _WAITS
    restarts: int = 0
    poll_s: float = 1.0

    @property
    def max_tries(self) -> int:
        """Return the number of tries after which an item is set aside."""
        return len(self.waits) + 1


@dataclass(frozen=True)
class Failure:
    """A failed try.

    Parameters
    ----------
    error : reason for the operator; shown : reason for the gym.
    tries : so far; again_at : time of the next try, None after the last one.
    """

    error: str
    shown: str
    tries: int
    again_at: datetime | None


class NotYetError(Exception):
    """The job cannot run before the time `at`; the present try does not count.

    Parameters
    ----------
    at : time of the next try.
    """

    def __init__(self, at: datetime) -> None:
        super().__init__(at)
        self.at = at


@dataclass(frozen=True)
class Task:
    """A job and its implementation.

    Parameters
    ----------
    run : processes a queued item; may be repeated at any point.
    note : writes a failure into the item's own row, in the transaction that queues the next try.
    """

    job: Job
    run: Callable[..., object]
    note: Callable[..., None] | None = None


def enqueue(
    session: Session,
    job: Job,
    *args: str | int,
    gym: UUID | str,
    key: str = "",
    priority: int = 1,
    delay: timedelta = timedelta(),
    tries: int = 0,
) -> None:
    """Queue a job in the session's transaction.

    Parameters
    ----------
    gym : the gym that it belongs to.
    key : of the workflow; an existing one stays as it is; empty: a new one.
    priority : lower ones begin first.
    delay : time before it may begin.
    tries : number of earlier tries.
    """
    options: EnqueueOptions = {
        "workflow_name": job.name,
        "queue_name": job.name,
        "workflow_id": key or f"{job.name}-{uuid4()}",
        "priority": priority,
    }
    if job.of_one_gym is not None:
        options["queue_partition_key"] = str(gym)
    if delay > timedelta():
        options["delay_seconds"] = delay.total_seconds()
    session.flush()  # the rows before the job that names them
    session.info["database"].jobs.enqueue_in_transaction(session, options, tries, *args)


def failure_of(job: Job, tries: int, error: BaseException) -> Failure:
    """Return the failure, and with it the next step, of a job whose try failed."""
    shown = reason_of(error) if isinstance(error, WalltopoError) else _DEFECT
    again_at = None
    if tries < job.max_tries:
        again_at = now() + timedelta(seconds=job.waits[tries - 1])
    return Failure(reason_of(error), shown, tries, again_at)


def reason_of(error: BaseException) -> str:
    """Return an error's reason for an operator, in one line."""
    text = str(error).partition("\n")[0]
    if isinstance(error, WalltopoError | InterruptedTryError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


class InterruptedTryError(Exception):
    """The worker died during the last try."""
