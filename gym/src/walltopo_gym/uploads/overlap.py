"""Which photos of a scan overlap with which, said before the scan: a durable job of some seconds.

Whenever the usable photos of a scan change, `ask` counts up in the table; what was asked and has no
answer yet is handed to DBOS, a workflow an asking. It looks at the thumbnails alone
(`walltopo.reconstruct.ingest.overlap`).
"""

from __future__ import annotations

from typing import Final
from uuid import UUID

import numpy as np
from dbos import DBOS, SetWorkflowID
from numpy.typing import NDArray
from sqlalchemy import String, cast, exists, select, update
from sqlalchemy.orm import Session

from walltopo.reconstruct.ingest.overlap import find_overlap
from walltopo_gym.attempts.bounded import MAX_TRIES, Attempts
from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.database.engine import Database
from walltopo_gym.storage.files import FileStore
from walltopo_gym.uploads.models import Photo, PhotoOverlap

QUEUE: Final = "overlaps"
_AT_ONCE: Final = 20

_overlaps: Overlaps | None = None


def ask(session: Session, scan: UUID) -> None:
    """The usable photos of a scan have changed: what was said of them is to be found out anew."""
    row = session.get(PhotoOverlap, scan)
    if row is None:
        session.add(PhotoOverlap(scan_id=scan, asked=1, answered=0, groups=[]))
    else:
        row.asked += 1


class Overlaps:
    """Hands what was asked to DBOS, and answers it."""

    def __init__(self, database: Database, store: FileStore) -> None:
        global _overlaps
        self._database, self._store = database, store
        self._attempts = Attempts(database, "overlap", _set_aside)
        _overlaps = self

    def begin_asked(self) -> None:
        """Hand what was asked to DBOS."""
        for scan, number, tries in self.claim():
            with SetWorkflowID(f"overlap-{scan}-{number}-{tries}"):
                DBOS.enqueue_workflow(QUEUE, _answer, str(scan), number)

    def claim(self) -> list[tuple[UUID, int, int]]:
        """Begin a try of what was asked, unless more photos are about to come.

        Return scan, number of the asking and number of the try.
        """
        coming = exists().where(
            Photo.scan_id == PhotoOverlap.scan_id, Photo.state.in_(("receiving", "received"))
        )
        tried = self._attempts.row_of(PhotoOverlap.scan_id, cast(PhotoOverlap.asked, String))
        asked = (
            select(PhotoOverlap.scan_id, PhotoOverlap.asked)
            .outerjoin(JobAttempt, tried)
            .where(PhotoOverlap.answered < PhotoOverlap.asked, ~coming, self._attempts.is_due())
        )
        with self._database.reading() as session:
            free = _AT_ONCE - self._attempts.held(session)
            rows = session.execute(asked.limit(max(0, free))).all()
        if not rows:
            return []
        with self._database.writing() as session:
            begun = [(scan, number, self._attempts.begin(session, scan, QUEUE, str(number)))
                     for scan, number in rows]  # fmt: skip
        return [row for row in begun if row[2]]

    def try_once(self, scan: UUID, number: int) -> None:
        """Find out what overlaps, and keep why where that fails."""
        with self._attempts.trying(scan):
            self.answer(scan, number)

    def answer(self, scan: UUID, number: int) -> None:
        """Find out what hangs together; may be done again at any point."""
        with self._database.reading() as session:
            usable = select(Photo).where(Photo.scan_id == scan, Photo.state == "usable")
            photos = list(session.scalars(usable.order_by(Photo.created_at, Photo.id)))
        # A video hangs together by itself; it is compared by several of its frames.
        shown = [(photo.id, key) for photo in photos for key in photo.thumbnails]
        found = find_overlap([_grey(self._store.read(key)) for _, key in shown])
        groups = [list(dict.fromkeys(str(shown[n][0]) for n in group)) for group in found.groups]
        # Where too much would have had to be compared, nothing is said.
        told = _joined(groups) if found.is_whole else []
        later = PhotoOverlap.scan_id == scan, PhotoOverlap.answered < number
        with self._database.writing() as session:
            change = update(PhotoOverlap).where(*later)
            session.execute(change.values(answered=number, groups=told))
            self._attempts.end(session, scan, str(number))


def _set_aside(session: Session, scan: UUID, why: str) -> None:
    """Say nothing about this asking; the next one is tried anew."""
    change = update(PhotoOverlap).where(PhotoOverlap.scan_id == scan)
    session.execute(change.values(answered=PhotoOverlap.asked, groups=[]))


def _grey(content: bytes) -> NDArray[np.uint8]:
    import cv2

    picture = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None, "a thumbnail of ours is a JPEG"
    return np.asarray(picture, dtype=np.uint8)


def _joined(groups: list[list[str]]) -> list[list[str]]:
    """Groups that share a photo (a video) are one; the largest first."""
    joined: list[list[str]] = []
    for group in groups:
        mine = [other for other in joined if set(other) & set(group)]
        for other in mine:
            joined.remove(other)
        joined.append(list(dict.fromkeys([*(name for other in mine for name in other), *group])))
    return sorted(joined, key=len, reverse=True)


@DBOS.workflow(name="overlap", max_recovery_attempts=MAX_TRIES)
def _answer(scan: str, number: int) -> None:
    DBOS.run_step({"name": "look"}, _look, scan, number)


def _look(scan: str, number: int) -> None:
    assert _overlaps is not None, "the worker has not begun"
    _overlaps.try_once(UUID(scan), number)
