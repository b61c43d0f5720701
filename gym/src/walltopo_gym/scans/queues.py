"""The background jobs of scans, queued in the transactions of the changes that need them.

A job checks whether it is still needed: if its row was cancelled, changed or deleted meanwhile, it
ends at once.
"""

from __future__ import annotations

from typing import Final
from uuid import UUID

from sqlalchemy import ColumnElement, exists, func, select
from sqlalchemy.orm import Session

from walltopo_gym.events import ReviewChanged, ScanFinished, publish_event
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.scans.models import Photo, PhotoOverlap, Scan
from walltopo_gym.walls.models import Wall

# A stage that kills its worker ends the scan at last; many a stop of a worker does not.
SCANS: Final = Job("scans", of_one_gym=None, waits=(), restarts=20)
BATCHES: Final = Job("photo-batches", at_once=2, of_one_gym=1, poll_s=0.5)
PHOTOS: Final = Job("photos", at_once=2, of_one_gym=1)
OVERLAPS: Final = Job("overlaps", at_once=2, of_one_gym=1)
MOVES: Final = Job("moves", at_once=1, of_one_gym=1)  # a wall takes a processor for seconds


def queue_scan(session: Session, scan: Scan) -> None:
    """Queue a run of a scan.

    A gym's first scan goes before every other gym's second one, and so on, so that a gym that
    queues ten delays only itself. The rank counts its running and queued scans.
    """
    gym = gym_of(session, scan.id)
    before = (
        select(func.count(Scan.id))
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym, Scan.state.in_(("queued", "running")), Scan.id != scan.id)
    )
    enqueue(
        session,
        SCANS,
        str(scan.id),
        scan.run,
        gym=gym,
        key=f"{scan.id}-{scan.run}",
        priority=1 + (session.scalar(before) or 0),
    )


def queue_batch(session: Session, scan: UUID) -> None:
    """Queue the check of a scan's received photos; once for those of one moment."""
    # Held until the transaction ends: a batch either begins after it, or is not this one.
    number = select(Scan.batches).where(Scan.id == scan).with_for_update(key_share=True)
    batch = session.scalar(number)
    if batch is not None:
        enqueue(
            session,
            BATCHES,
            str(scan),
            batch,
            gym=gym_of(session, scan),
            key=f"photo-batch-{scan}-{batch}",
        )


def queue_photo(session: Session, photo: Photo) -> None:
    """Queue the check of a single photo."""
    gym = gym_of(session, photo.scan_id)
    enqueue(session, PHOTOS, str(photo.id), gym=gym, key=f"photo-{photo.id}")


def photos_changed(session: Session, scan: UUID) -> None:
    """Queue the grouping of photos by overlap, unless more photos are about to come."""
    session.flush()
    there = session.info["database"].insert(PhotoOverlap)
    first = there.values(scan_id=scan, requested=1, answered=0, groups=[], shifts=[], gaps=[])
    # Held until the transaction ends: of two last photos, one sees that the other has come.
    again = first.on_conflict_do_update(
        index_elements=[PhotoOverlap.scan_id], set_={"requested": PhotoOverlap.requested + 1}
    )
    number = session.scalar(again.returning(PhotoOverlap.requested))
    assert number is not None
    if not session.scalar(select(are_coming(scan))):
        enqueue(
            session,
            OVERLAPS,
            str(scan),
            number,
            gym=gym_of(session, scan),
            key=f"overlap-{scan}-{number}",
        )


def are_coming(scan: UUID) -> ColumnElement[bool]:
    """Return whether photos of a scan are being uploaded or wait for their check."""
    return exists().where(Photo.scan_id == scan, Photo.state.in_(("receiving", "received")))


def routes_changed(session: Session, scan: UUID) -> None:
    """Tell that the routes of a scan are new, or were edited."""
    publish_event(session, ReviewChanged(gym_of(session, scan), scan))


def scan_finished(session: Session, scan: UUID, *, failed: bool) -> None:
    """Tell that a scan reached its review, or failed."""
    wall = session.get_one(Scan, scan).wall_id
    publish_event(session, ScanFinished(gym_of(session, scan), wall, scan, failed))


def queue_moves(session: Session, scan: UUID, priority: int = 1) -> None:
    """Queue the suggested moves of a published version; once per version."""
    enqueue(
        session, MOVES, str(scan), gym=gym_of(session, scan), key=f"moves-{scan}", priority=priority
    )


def gym_of(session: Session, scan: UUID) -> UUID:
    """Return the gym of a scan that exists."""
    gym = select(Wall.gym_id).join(Scan, Scan.wall_id == Wall.id).where(Scan.id == scan)
    return session.scalars(gym).one()
