"""Check each uploaded photo: readable, sharp, not a duplicate.

The product's `ingest` does it, in a child process that may crash on a photo. Thumbnails are made
from pixels alone: place, time, serial numbers and the people that are found stay in the private
original. From a video, `ingest` takes the sharpest frame of each stretch of camera motion; here the
frames are counted.

New photos of a scan are checked together, because the child costs more than a photo. Photos that
fail, or were being checked when a worker was killed, get a job each.
"""

from __future__ import annotations

import io
import logging
import tempfile
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Final
from uuid import UUID

import numpy as np
from PIL import Image
from sqlalchemy import ColumnElement, and_, select, update
from sqlalchemy.orm import Session

from walltopo.core import EnvironmentLacksError, Silent
from walltopo.images.files import read_grey, read_rgb
from walltopo.images.fill import hide_pixels
from walltopo.images.markers import detect_markers
from walltopo.images.people import find_people, people_mask
from walltopo.reconstruct.ingest.decoding import Done, decode_files
from walltopo.reconstruct.ingest.image_file import MIN_SHARPNESS
from walltopo.reconstruct.scale.plates import built_in_plates
from walltopo.reconstruct.settings import IngestSettings
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.jobs.queue import Failure, NotYetError
from walltopo_gym.scans.models import MAX_THUMBNAILS, Photo, Scan
from walltopo_gym.scans.queues import photos_changed, queue_batch, queue_photo
from walltopo_gym.scans.receiving import is_video, suffix_of
from walltopo_gym.storage.files import FileStore

_LOG = logging.getLogger("walltopo_gym.scans")
_TOGETHER: Final = 16
_THUMBNAIL: Final = 480
_LACKING: Final = timedelta(seconds=10)  # until a machine that lacks something is tried again


@dataclass(frozen=True)
class PhotoChecks:
    """The job that checks the photos of scans."""

    database: Database
    store: FileStore

    def check_batch(self, scan: str, number: int) -> None:
        """Check the unchecked photos of a scan. Those that fail, or were being checked when a
        worker was killed, get a job each."""
        one = UUID(scan)
        with self.database.writing() as session:
            photos = _begin_batch(session, one, number)
        try:
            for photo, error in _check_photos(self.database, self.store, photos):
                _LOG.warning("photo %s is looked at alone: %s", photo.id, error)
        except EnvironmentLacksError as error:  # the machine's fault, and no photo's
            with self.database.writing() as session:
                session.execute(
                    update(Photo).where(_is_unchecked_in_batch(one, number)).values(batch=None)
                )
            _LOG.error("photos wait: %s", error)
            raise NotYetError(now() + _LACKING) from error
        except Exception:
            _LOG.exception("%s photos failed together; each is looked at alone", len(photos))
        with self.database.writing() as session:
            for photo in session.scalars(
                select(Photo).where(_is_unchecked_in_batch(one, number))
            ).all():
                queue_photo(session, photo)
            new = Photo.scan_id == one, Photo.state == "received", Photo.batch.is_(None)
            if session.scalar(select(Photo.id).where(*new).limit(1)) is not None:
                queue_batch(session, one)

    def check(self, photo: str) -> None:
        """Check one photo.

        Raises
        ------
        NotYetError : this machine lacks something for it.
        """
        with self.database.reading() as session:
            row = session.get(Photo, UUID(photo))
        if row is None or row.state != "received":
            return
        try:
            for _, error in _check_photos(self.database, self.store, [row]):
                raise error
        except EnvironmentLacksError as error:
            raise NotYetError(now() + _LACKING) from error


def record_failure(session: Session, failure: Failure, photo: str) -> None:
    """After the last try, mark the photo as unusable in the gym's list."""
    if failure.again_at is not None:
        return
    why = failure.shown
    reason = f"this photo could not be checked ({why}); take it back and send it again"
    received = Photo.id == UUID(photo), Photo.state == "received"
    change = update(Photo).where(*received).values(state="unusable", reason=reason[:500])
    scan = session.scalar(change.returning(Photo.scan_id))
    if scan is not None:
        photos_changed(session, scan)


def _begin_batch(session: Session, scan: UUID, number: int) -> Sequence[Photo]:
    """Assign photos to a batch; none if a killed worker began that batch."""
    batches = update(Scan).where(Scan.id == scan, Scan.batches == number)
    session.execute(batches.values(batches=number + 1))
    if (
        session.scalar(select(Photo.id).where(_is_unchecked_in_batch(scan, number)).limit(1))
        is not None
    ):
        return []
    new = (
        select(Photo)
        .where(Photo.scan_id == scan, Photo.state == "received", Photo.batch.is_(None))
        .order_by(Photo.created_at, Photo.id)
        .limit(_TOGETHER)
    )
    photos = session.scalars(new.with_for_update(skip_locked=True)).all()
    for photo in photos:
        photo.batch = number
    return photos


def _is_unchecked_in_batch(scan: UUID, number: int) -> ColumnElement[bool]:
    """Return the condition of unchecked photos of a batch."""
    return and_(Photo.scan_id == scan, Photo.batch == number, Photo.state == "received")


def _check_photos(
    database: Database, store: FileStore, photos: Sequence[Photo]
) -> list[tuple[Photo, Exception]]:
    """Check photos together; return those that failed by themselves, and why."""
    failed: list[tuple[Photo, Exception]] = []
    with tempfile.TemporaryDirectory(prefix="walltopo-look-") as name:
        folder = Path(name)
        files = []
        for number, photo in enumerate(photos):
            try:
                files.append((number, _fetch_original(store, photo, folder / str(number))))
            except Exception as error:
                failed.append((photo, error))
        made = folder / "made"
        made.mkdir()
        with closing(decode_files(files, made, IngestSettings(), Silent())) as answers:
            for done in answers:
                try:
                    _store_result(database, store, photos[done.number], done, made)
                except Exception as error:
                    failed.append((photos[done.number], error))
    return failed


def _fetch_original(store: FileStore, photo: Photo, path: Path) -> Path:
    file = path.with_suffix(suffix_of(photo.name))
    store.fetch(photo.original, file)
    return file


def _store_result(
    database: Database, store: FileStore, photo: Photo, done: Done, made: Path
) -> None:
    reason, note = "; ".join(done.reasons), ""
    facts: dict[str, object] = {}
    if done.photos:
        sharpest = max(done.photos, key=lambda stored: stored.sharpness)
        facts = {
            "width": sharpest.width,
            "height": sharpest.height,
            "sharpness": sharpest.sharpness,
            "frames": len(done.photos),
        }
        indices = np.linspace(0, len(done.photos) - 1, min(len(done.photos), MAX_THUMBNAILS))
        shown = [made / done.photos[index].file for index in indices.round().astype(int).tolist()]
        for number, path in enumerate(shown):
            store.put(photo.thumbnail_of(number), _make_thumbnail(path))
        facts["plate_frames"] = _frames_with_plate(shown)
        for stored in done.photos:
            (made / stored.file).unlink()
        if sharpest.sharpness < MIN_SHARPNESS:
            reason = "blurred"
        elif is_video(photo.name):
            # The frames before the damage are as good as a shorter film.
            note, reason = reason, ""
    with database.writing() as session:
        first = session.scalars(
            select(Photo)
            .where(Photo.scan_id == photo.scan_id, Photo.sha256 == photo.sha256)
            .order_by(Photo.created_at, Photo.id)
        ).first()
        if first is not None and first.id == photo.id:
            first = None
        reason = reason or (f"the same photo as {first.name}" if first else "")
        change = update(Photo).where(Photo.id == photo.id, Photo.state == "received")
        state = "unusable" if reason else "usable"
        session.execute(change.values(state=state, reason=(reason or note)[:500], **facts))
        photos_changed(session, photo.scan_id)


def _frames_with_plate(paths: Sequence[Path]) -> int:
    """Count the photos that show two markers of one scale plate; one may be a false alarm."""
    plates = built_in_plates()
    dictionaries = sorted({plate.dictionary for plate in plates})
    count = 0
    for path in paths:
        found = detect_markers(read_grey(path), path.name, dictionaries)
        markers = {detection.marker for detection in found}
        count += any(len(markers.intersection(plate.ids)) >= 2 for plate in plates)
    return count


def _make_thumbnail(path: Path) -> bytes:
    """Return a small JPEG of a photo, in which the people that are found are hidden."""
    photo = read_rgb(path)
    people = find_people(photo)
    if people:
        photo = hide_pixels(photo, people_mask(photo, people))
    small = Image.fromarray(photo)
    small.thumbnail((_THUMBNAIL, _THUMBNAIL))
    out = io.BytesIO()
    small.save(out, "JPEG", quality=80)
    return out.getvalue()
