"""Find the groups of overlapping photos before the scan: a job of some seconds.

It uses thumbnails only (`walltopo.reconstruct.ingest.overlap`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from uuid import UUID

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from walltopo.reconstruct.ingest.overlap import Shift, find_overlap
from walltopo_gym.database.engine import Database
from walltopo_gym.jobs.queue import Failure
from walltopo_gym.scans.models import Photo, PhotoOverlap
from walltopo_gym.scans.queues import are_coming
from walltopo_gym.storage.files import FileStore


@dataclass(frozen=True)
class Overlaps:
    """The job that groups the photos of a scan by overlap."""

    database: Database
    store: FileStore

    def answer(self, scan: str, number: int) -> None:
        """Compute the groups, unless the photos have changed since the job was queued."""
        one = UUID(scan)
        with self.database.reading() as session:
            row = session.get(PhotoOverlap, one)
            if row is None or row.requested != number or session.scalar(select(are_coming(one))):
                return  # it is queued again when they are there
            usable = select(Photo).where(Photo.scan_id == one, Photo.state == "usable")
            photos = list(session.scalars(usable.order_by(Photo.created_at, Photo.id)))
        # A video hangs together by itself; it is compared by several of its frames.
        shown = [(photo.id, key) for photo in photos for key in photo.thumbnails]
        found = find_overlap([_grey(self.store.read(key)) for _, key in shown])
        groups = [list(dict.fromkeys(str(shown[n][0]) for n in group)) for group in found.groups]
        shifts = _between_photos(found.shifts, [photo for photo, _ in shown])
        groups = _join_groups(groups)
        gaps = [[str(shown[n][0]) for n in gap] for gap in found.gaps]
        gaps = [gap for gap in gaps if not any(set(gap) <= set(group) for group in groups)]
        with self.database.writing() as session:
            if found.is_whole:
                _store_overlap(session, one, number, groups, shifts, gaps)
            else:  # without a result if there would be too many pairs to compare
                _store_overlap(session, one, number)


def record_failure(session: Session, failure: Failure, scan: str, number: int) -> None:
    """After the last try, store no groups for these photos; a change of the photos tries anew."""
    if failure.again_at is None:
        _store_overlap(session, UUID(scan), number)


def _store_overlap(
    session: Session,
    scan: UUID,
    number: int,
    groups: Sequence[list[str]] = (),
    shifts: Sequence[dict[str, Any]] = (),
    gaps: Sequence[list[str]] = (),
) -> None:
    later = PhotoOverlap.scan_id == scan, PhotoOverlap.answered < number
    found = {"groups": list(groups), "shifts": list(shifts), "gaps": list(gaps)}
    session.execute(update(PhotoOverlap).where(*later).values(answered=number, **found))


def _between_photos(shifts: Sequence[Shift], photo_of: list[UUID]) -> list[dict[str, Any]]:
    """Return the shifts between two photos as plain values, without those inside of a video."""
    return [
        {
            "before": str(photo_of[shift.before]),
            "after": str(photo_of[shift.after]),
            "right": round(shift.right, 3),
            "up": round(shift.up, 3),
        }
        for shift in shifts
        if photo_of[shift.before] != photo_of[shift.after]
    ]


def _grey(content: bytes) -> NDArray[np.uint8]:
    import cv2

    picture = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None, "a thumbnail of ours is a JPEG"
    return np.asarray(picture, dtype=np.uint8)


def _join_groups(groups: list[list[str]]) -> list[list[str]]:
    """Join groups that share a photo (a video); return the largest first."""
    joined: list[list[str]] = []
    for group in groups:
        mine = [other for other in joined if set(other) & set(group)]
        for other in mine:
            joined.remove(other)
        joined.append(list(dict.fromkeys([*(name for other in mine for name in other), *group])))
    return sorted(joined, key=len, reverse=True)
