"""The scans that an operator may have to see to."""

from __future__ import annotations

from collections.abc import Iterator
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.scans.asking import start
from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.states import State, move

_SHOWN = (State.RUNNING, State.QUEUED, State.FAILED)


def jobs(session: Session) -> Iterator[str]:
    """A line each: those at work, those that wait, those that failed, and what was set aside of the
    other background jobs."""
    rows = session.execute(
        select(Scan, Wall.name, Gym.slug, ScanProgress)
        .join(Wall, Wall.id == Scan.wall_id)
        .join(Gym, Gym.id == Wall.gym_id)
        .outerjoin(ScanProgress, ScanProgress.scan_id == Scan.id)
        .where(Scan.state.in_(_SHOWN))
        .order_by(Scan.state.desc(), Scan.created_at)
    )
    for scan, wall, gym, progress in rows:
        said = scan.error
        if scan.state == State.RUNNING and progress is not None:
            said = f"{progress.stage}: {progress.doing} (heard of {progress.at:%Y-%m-%d %H:%M})"
        yield f"{scan.id} {scan.state:<8} {gym}/{wall} {said}"
    aside = select(JobAttempt).where(JobAttempt.next_at.is_(None)).order_by(JobAttempt.begun_at)
    for row in session.scalars(aside):
        yield f"{row.item} set aside {row.kind}: {row.error} ({row.tries} tries)"


def retry(session: Session, scan: UUID) -> None:
    """Queue a scan again.

    Raises
    ------
    NotFoundError : there is none; ConflictError : it is at work, or its photos do not do.
    """
    row = _scan(session, scan)
    start(session, row)
    log_change(session, "scan.start", person=None, subject=str(scan))


def cancel(session: Session, scan: UUID) -> None:
    """Stop working on a scan.

    Raises
    ------
    NotFoundError : there is none; ConflictError : nobody works on it.
    """
    move(session, _scan(session, scan).id, State.CANCELLED)
    log_change(session, "scan.cancel", person=None, subject=str(scan))


def _scan(session: Session, scan: UUID) -> Scan:
    row = session.get(Scan, scan)
    if row is None:
        raise NotFoundError(f"no scan {scan}")
    return row
