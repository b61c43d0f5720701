"""A scan's states and their transitions."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Final
from uuid import UUID

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.scans.models import Photo, Scan
from walltopo_gym.scans.queues import queue_scan
from walltopo_gym.walls.models import Wall


class State(StrEnum):
    """States from the first photo to a former version."""

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
    """Refuse to edit or publish a scan outside of review.

    Raises
    ------
    ConflictError : it is not in review.
    """
    if state != State.REVIEW:
        raise ConflictError("not-in-review", state=state)


def change_state(
    session: Session, scan: UUID, to: State, *, run: int | None = None, before: State | None = None
) -> None:
    """Change a scan's state, if its present state allows it.

    Parameters
    ----------
    run : the number of the requesting job; a replaced job has no effect.
    before : the only state to leave, if it is not one of the usual ones.

    Raises
    ------
    ConflictError : it is in another state by now.
    """
    change = update(Scan).where(Scan.id == scan, Scan.state.in_({before} if before else _NEXT[to]))
    if run is not None:
        change = change.where(Scan.run == run)
    if session.execute(change.values(state=to).returning(Scan.id)).one_or_none() is None:
        now = session.get(Scan, scan)
        state = "gone" if now is None else now.state
        raise ConflictError("scan-state", state=state, to=to)


_FEWEST_PHOTOS: Final = 3


def create_version(session: Session, wall: Wall, person: UUID) -> Scan:
    """Create a version for uploads, in the coordinate frame of the published one."""
    scan = Scan(
        wall_id=wall.id,
        made_by=person,
        state=State.UPLOADING,
        reference_id=wall.published_scan_id,
    )
    session.add(scan)
    session.flush()
    return scan


def request_run(
    session: Session, scan: Scan, *, part: bool = False, colours: Sequence[str] = ()
) -> None:
    """Queue a scan, also after a failure or a cancellation.

    Parameters
    ----------
    part : the photos show a part of the wall; the rest is taken from the version that is
        published now.
    colours : with `part`: only holds of these colours are exchanged; empty: all.

    Raises
    ------
    ConflictError : photos are still on their way, too few are usable, it is running already, or
        nothing is published of which the photos could show a part.
    """
    _check_photos(session, scan)
    published = session.get_one(Wall, scan.wall_id).published_scan_id
    if part and (published is None or scan.reference_id is None):
        raise ConflictError("part-of-nothing")
    begin_run(session, scan)
    scan.part, scan.colours = part, list(colours)
    if part:
        scan.reference_id = published


def begin_run(session: Session, scan: Scan, *, before: State | None = None) -> None:
    """Queue the next run of a scan.

    Parameters
    ----------
    before : see `change_state`.

    Raises
    ------
    ConflictError : its state does not allow it.
    """
    change_state(session, scan.id, State.QUEUED, before=before)
    session.refresh(scan)
    scan.run, scan.error, scan.hint = scan.run + 1, "", ""
    queue_scan(session, scan)


def _check_photos(session: Session, scan: Scan) -> None:
    counted = session.execute(
        select(Photo.state, func.sum(Photo.frames))
        .where(Photo.scan_id == scan.id)
        .group_by(Photo.state)
    )
    states = {row[0]: row[1] for row in counted}
    waiting = states.get("receiving", 0) + states.get("received", 0)
    if waiting:
        raise ConflictError("photos-on-their-way", "wait-or-take-back", count=waiting)
    usable = states.get("usable", 0)
    if usable < _FEWEST_PHOTOS:
        raise ConflictError("photos-too-few", "take-more", count=usable, least=_FEWEST_PHOTOS)


def scan_of(session: Session, gym: UUID, scan: UUID) -> Scan:
    """Return a scan of this gym.

    Raises
    ------
    NotFoundError : this gym has no such scan.
    """
    found = select(Scan).join(Wall, Wall.id == Scan.wall_id)
    row = session.scalar(found.where(Scan.id == scan, Wall.gym_id == gym))
    if row is None:
        raise NotFoundError("not-there-scan")
    return row
