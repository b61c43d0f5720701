"""Scans that may need an operator."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.database.engine import Database
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.service import State, change_state, request_run
from walltopo_gym.walls.models import Wall

_SHOWN = (State.RUNNING, State.QUEUED, State.FAILED)
_ASIDE = ["ERROR", "MAX_RECOVERY_ATTEMPTS_EXCEEDED"]  # DBOS's words for it


def job_lines(database: Database) -> list[str]:
    """Return a line for each running, waiting and failed scan, and for other jobs that were set
    aside."""
    wanted = (
        select(Scan, Wall.name, Gym.slug, ScanProgress)
        .join(Wall, Wall.id == Scan.wall_id)
        .join(Gym, Gym.id == Wall.gym_id)
        .outerjoin(ScanProgress, ScanProgress.scan_id == Scan.id)
        .where(Scan.state.in_(_SHOWN))
        .order_by(Scan.state.desc(), Scan.created_at)
    )
    lines = []
    with database.reading() as session:
        for scan, wall, gym, progress in session.execute(wanted):
            detail = scan.error
            if scan.state == State.RUNNING and progress is not None:
                detail = (
                    f"{progress.stage}: {progress.doing} (heard of {progress.at:%Y-%m-%d %H:%M})"
                )
            lines.append(f"{scan.id} {scan.state:<8} {gym}/{wall} {detail}")
    # DBOS begins a transaction of its own, which on SQLite would wait for one of ours for ever.
    check_unlocked("jobs are listed")
    for job in database.jobs.list_workflows(status=_ASIDE):
        items = " ".join(map(str, job.input["args"][1:])) if job.input else job.workflow_id
        lines.append(f"{items} set aside {job.name}: {job.error or job.status}")
    return lines


def retry_scan(session: Session, scan: UUID) -> None:
    """Queue a scan again.

    Raises
    ------
    NotFoundError : no such scan; ConflictError : it is running, or its photos are unusable.
    """
    row = _scan(session, scan)
    request_run(session, row)
    log_change(session, "scan.start", person=None, subject=str(scan))


def cancel_scan(session: Session, scan: UUID) -> None:
    """Cancel a scan.

    Raises
    ------
    NotFoundError : no such scan; ConflictError : it is not running.
    """
    change_state(session, _scan(session, scan).id, State.CANCELLED)
    log_change(session, "scan.cancel", person=None, subject=str(scan))


def _scan(session: Session, scan: UUID) -> Scan:
    row = session.get(Scan, scan)
    if row is None:
        raise NotFoundError("not-there-scan-id", scan=scan)
    return row
