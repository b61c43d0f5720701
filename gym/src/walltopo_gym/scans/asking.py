"""Asking for a version of a wall: begun, then started when its photos are there."""

from __future__ import annotations

from typing import Final
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import State, move
from walltopo_gym.uploads.models import Photo

_FEWEST_PHOTOS: Final = 3


def begin(session: Session, wall: Wall, person: UUID) -> Scan:
    """A new version, to which photos are sent; it will lie in the frame of the published one."""
    scan = Scan(
        wall_id=wall.id,
        made_by=person,
        state=State.UPLOADING,
        reference_id=wall.published_scan_id,
    )
    session.add(scan)
    session.flush()
    return scan


def start(session: Session, scan: Scan) -> None:
    """Queue it; again, where it failed or was cancelled.

    Raises
    ------
    ConflictError : photos are still on their way, or too few are usable; it is at work already.
    """
    _check_photos(session, scan)
    move(session, scan.id, State.QUEUED)
    session.refresh(scan)
    scan.run, scan.error, scan.hint = scan.run + 1, "", ""


def _check_photos(session: Session, scan: Scan) -> None:
    counted = session.execute(
        select(Photo.state, func.sum(Photo.frames))
        .where(Photo.scan_id == scan.id)
        .group_by(Photo.state)
    )
    states = {row[0]: row[1] for row in counted}
    waiting = states.get("receiving", 0) + states.get("received", 0)
    if waiting:
        raise ConflictError(f"{waiting} photos are still on their way", "Wait, or take them back.")
    usable = states.get("usable", 0)
    if usable < _FEWEST_PHOTOS:
        raise ConflictError(
            f"{usable} usable photos, at least {_FEWEST_PHOTOS} are needed", "Take more photos."
        )
