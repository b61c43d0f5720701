"""What a scan can be, and what it can become."""

from __future__ import annotations

from enum import StrEnum
from typing import Final
from uuid import UUID

from sqlalchemy import update
from sqlalchemy.orm import Session

from walltopo_gym.errors import ConflictError
from walltopo_gym.scans.models import Scan


class State(StrEnum):
    """From the first photo to a former version."""

    UPLOADING = "uploading"
    QUEUED = "queued"
    RUNNING = "running"
    REVIEW = "review"
    PUBLISHED = "published"
    SUPERSEDED = "superseded"
    FAILED = "failed"
    CANCELLED = "cancelled"


_NEXT: Final = {
    State.QUEUED: {State.UPLOADING, State.FAILED, State.CANCELLED},
    State.RUNNING: {State.QUEUED, State.RUNNING},
    State.REVIEW: {State.RUNNING},
    State.FAILED: {State.QUEUED, State.RUNNING},
    State.CANCELLED: {State.QUEUED, State.RUNNING},
    State.PUBLISHED: {State.REVIEW, State.SUPERSEDED},
    State.SUPERSEDED: {State.PUBLISHED},
}


def check_in_review(state: str) -> None:
    """Refuse to edit or publish what is published, or not there yet.

    Raises
    ------
    ConflictError : so it is.
    """
    if state != State.REVIEW:
        raise ConflictError(f"the scan is {state}, not in review")


def move(session: Session, scan: UUID, to: State, *, run: int | None = None) -> None:
    """Change a scan's state, if it is in one from which that can be done.

    Parameters
    ----------
    run : the job that says so; one that was replaced by a later one is not heard.

    Raises
    ------
    ConflictError : it is in another state by now.
    """
    change = update(Scan).where(Scan.id == scan, Scan.state.in_(_NEXT[to]))
    if run is not None:
        change = change.where(Scan.run == run)
    if session.execute(change.values(state=to).returning(Scan.id)).one_or_none() is None:
        now = session.get(Scan, scan)
        state = "gone" if now is None else now.state
        raise ConflictError(f"the scan is {state}; it cannot become {to}")
