"""Jobs that may need an operator: scans that run, wait or failed, and jobs that were set aside."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final
from uuid import NAMESPACE_URL, UUID, uuid5

from sqlalchemy import Row, Select, case, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.database.engine import Database
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.service import State, change_state, request_run
from walltopo_gym.walls.models import Wall

if TYPE_CHECKING:
    from dbos import WorkflowStatus

_SHOWN: Final = (State.RUNNING, State.QUEUED, State.FAILED)
_ASIDE: Final = ["ERROR", "MAX_RECOVERY_ATTEMPTS_EXCEEDED"]  # DBOS's words for it
_MAX: Final = 200  # of each kind
# Their items were given up in their own rows: another try would find nothing to do.
GIVEN_UP: Final = frozenset(
    {"backups", "clips", "mails", "photos", "publications", "pushes", "scans"}
)


@dataclass(frozen=True)
class ScanJob:
    """A scan that runs, waits or failed.

    Parameters
    ----------
    gym, wall : slug and name. error, hint : why it failed, and what to do.
    stage, doing, notes, heard_at : what a running scan does, what it has noted, and the time of its
        last word.
    """

    id: UUID
    state: State
    gym: str
    wall: str
    created_at: datetime
    error: str
    hint: str
    stage: str = ""
    doing: str = ""
    notes: tuple[str, ...] = ()
    heard_at: datetime | None = None


@dataclass(frozen=True)
class SetAsideJob:
    """A job that failed in all tries.

    Parameters
    ----------
    kind : the job's name; items : what it was about; gym : its slug, empty if it is gone.
    can_retry : whether another try makes sense.
    """

    id: str
    kind: str
    items: str
    gym: str
    error: str
    at: datetime
    can_retry: bool


@dataclass(frozen=True)
class Jobs:
    """Jobs that may need an operator; `more`: there are more than these."""

    scans: list[ScanJob]
    set_aside: list[SetAsideJob]
    more: bool


def list_jobs(database: Database) -> Jobs:
    """Return running, waiting and failed scans, and the jobs that were set aside."""
    with database.reading() as session:
        scans = [_scan_job(row) for row in session.execute(_scans().limit(_MAX + 1))]
    # DBOS begins a transaction of its own, which on SQLite would wait for one of ours for ever.
    check_unlocked("jobs are listed")
    rows = database.jobs.list_workflows(status=_ASIDE, limit=_MAX + 1, sort_desc=True)
    with database.reading() as session:
        slugs = _slugs_by_key(session, rows)
    aside = [_set_aside_job(row, slugs) for row in rows]
    return Jobs(scans[:_MAX], aside[:_MAX], more=max(len(scans), len(aside)) > _MAX)


def _scans() -> Select[*tuple[Any, ...]]:
    order = case({state: number for number, state in enumerate(_SHOWN)}, value=Scan.state)
    return (
        select(Scan, Wall.name, Gym.slug, ScanProgress)
        .join(Wall, Wall.id == Scan.wall_id)
        .join(Gym, Gym.id == Wall.gym_id)
        .outerjoin(ScanProgress, ScanProgress.scan_id == Scan.id)
        .where(Scan.state.in_(_SHOWN))
        .order_by(order, Scan.created_at.desc())
    )


def _scan_job(row: Row[*tuple[Any, ...]]) -> ScanJob:
    scan, wall, gym, progress = row
    known = ScanJob(scan.id, State(scan.state), gym, wall, scan.created_at, scan.error, scan.hint)
    if scan.state != State.RUNNING or progress is None:
        return known
    return ScanJob(
        **vars(known)
        | {
            "stage": progress.stage,
            "doing": progress.doing,
            "notes": tuple(progress.notes),
            "heard_at": progress.at,
        }
    )


def _set_aside_job(row: WorkflowStatus, slugs: dict[str, str]) -> SetAsideJob:
    items = " ".join(map(str, row.input["args"][1:])) if row.input else row.workflow_id
    moment = row.updated_at or row.created_at or 0
    return SetAsideJob(
        id=row.workflow_id,
        kind=row.name,
        items=items,
        gym=slugs.get(row.queue_partition_key or "", ""),
        error=str(row.error or row.status),
        at=datetime.fromtimestamp(moment / 1000, UTC),
        can_retry=row.input is not None and row.name not in GIVEN_UP,
    )


def _slugs_by_key(session: Session, rows: list[WorkflowStatus]) -> dict[str, str]:
    """Return the slugs of the gyms of jobs by the key of their queue's part."""
    ids = set()
    for row in rows:
        try:
            ids.add(UUID(row.queue_partition_key or ""))
        except ValueError:  # a queue without parts
            continue
    found = session.execute(select(Gym.id, Gym.slug).where(Gym.id.in_(ids)))
    return {str(gym): slug for gym, slug in found}


def job_lines(database: Database) -> list[str]:
    """Return the lines of `walltopo gym jobs`."""
    found = list_jobs(database)
    lines = []
    for scan in found.scans:
        detail = scan.error
        if scan.heard_at is not None:
            detail = f"{scan.stage}: {scan.doing} (heard of {scan.heard_at:%Y-%m-%d %H:%M})"
        lines.append(f"{scan.id} {scan.state:<8} {scan.gym}/{scan.wall} {detail}")
    for job in found.set_aside:
        lines.append(f"{job.items} set aside {job.kind}: {job.error}")
        if job.can_retry:
            lines.append(f"    walltopo gym jobs retry {job.id}")
    if found.more:
        lines.append("... and more")
    return lines


def retry_scan(session: Session, scan: UUID, by: UUID | None = None) -> None:
    """Queue a scan again.

    Parameters
    ----------
    by : the operator; None: by command.

    Raises
    ------
    NotFoundError : no such scan; ConflictError : it is running, or its photos are unusable.
    """
    row = _scan(session, scan)
    request_run(session, row)
    log_change(session, "scan.start", person=by, gym=_gym_of(session, row), subject=str(scan))


def cancel_scan(session: Session, scan: UUID, by: UUID | None = None) -> None:
    """Cancel a scan.

    Parameters
    ----------
    by : as in `retry_scan`.

    Raises
    ------
    NotFoundError : no such scan; ConflictError : it is not running.
    """
    row = _scan(session, scan)
    change_state(session, row.id, State.CANCELLED)
    log_change(session, "scan.cancel", person=by, gym=_gym_of(session, row), subject=str(scan))


def retry_job(database: Database, job: str, by: UUID | None = None) -> None:
    """Queue a job that was set aside, with as many tries as a new one.

    Parameters
    ----------
    job : its id; by : as in `retry_scan`.

    Raises
    ------
    NotFoundError : no such job was set aside; ConflictError : its item was given up.
    """
    check_unlocked("jobs are listed")
    row = next(iter(database.jobs.list_workflows(workflow_ids=[job], status=_ASIDE)), None)
    if row is None or row.input is None:
        raise NotFoundError("not-there-job")
    if row.name in GIVEN_UP:
        raise ConflictError("job-given-up", "job-given-up-hint")
    items = row.input["args"][1:]
    part = row.queue_partition_key
    kind = Job(row.name, of_one_gym=None if part is None else 1)
    key = f"{row.name}-{uuid5(NAMESPACE_URL, job)}"  # the same for two who retry it at once
    with database.writing() as session:
        enqueue(session, kind, *items, gym=part or "", key=key, priority=row.priority or 1)
        about = " ".join(map(str, items))
        log_change(session, "job.retry", person=by, subject=row.name, items=about)
    # After the new one is queued: a kill in between leaves both, and none is lost.
    database.jobs.delete_workflow(job)


def _scan(session: Session, scan: UUID) -> Scan:
    row = session.get(Scan, scan)
    if row is None:
        raise NotFoundError("not-there-scan-id", scan=scan)
    return row


def _gym_of(session: Session, scan: Scan) -> UUID:
    return session.get_one(Wall, scan.wall_id).gym_id
