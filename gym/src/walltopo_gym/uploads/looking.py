"""Looking at what came in: can it be read, is it sharp, was it sent before.

By walltopo's own ingest, in a child process that may die of what it is given. What others see is
made from the pixels alone: place, time and serial numbers stay in the original, which is private.
Of a video ingest takes the sharpest frame of each stretch of camera motion; here they are counted.
"""

from __future__ import annotations

import io
import logging
import tempfile
import threading
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Final
from uuid import UUID

import numpy as np
from sqlalchemy import ColumnElement, Uuid, column, func, select, table, update
from sqlalchemy.orm import Session

from walltopo.core import EnvironmentLacksError, Silent
from walltopo.images.files import open_picture
from walltopo.reconstruct.ingest.decode_job import Done
from walltopo.reconstruct.ingest.decoding import decode_files
from walltopo.reconstruct.ingest.image_file import LEAST_SHARPNESS
from walltopo.reconstruct.ingest.settings import IngestSettings
from walltopo_gym.attempts.bounded import Attempts
from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.models import Wall
from walltopo_gym.storage.files import FileStore
from walltopo_gym.uploads.models import MOST_THUMBNAILS, Photo
from walltopo_gym.uploads.overlap import ask
from walltopo_gym.uploads.receiving import is_video, suffix_of

_LOG = logging.getLogger("walltopo_gym.uploads")
_AT_ONCE: Final = 16
_THUMBNAIL: Final = 480
# Scans are a layer above; here only the way from a photo to its gym is needed.
_SCANS: Final = table("scans", column("id", Uuid()), column("wall_id", Uuid()))


def look_at_all(database: Database, store: FileStore, worker: str, stop: threading.Event) -> None:
    """Look at photos until none waits, or `stop`."""
    while look_at_some(database, store, worker) and not stop.is_set():
        pass


def look_at_some(database: Database, store: FileStore, worker: str = "a worker") -> int:
    """Look at photos that nobody has looked at yet, each gym's in turn; return how many were tried.

    May be cut short at any point. New photos are looked at together; those that fail together, or
    were being looked at when a worker was killed, one by one.
    """
    fresh = _claim(database, worker, JobAttempt.item.is_(None), _AT_ONCE)
    again = [] if fresh else _claim(database, worker, JobAttempt.next_at <= now(), 1)
    try:
        if fresh:
            _look(database, store, fresh)
    except EnvironmentLacksError:  # the machine's fault, and no photo's
        _attempts(database).let_go(worker, counted=False)
        raise
    except Exception:
        _LOG.exception("%s photos failed together; each is looked at alone", len(fresh))
        again = fresh
    for photo in again:
        with _attempts(database).trying(photo.id):
            _look(database, store, [photo])
    return len(fresh) or len(again)


def let_go(database: Database, worker: str) -> None:
    """Let others look at what a killed worker was looking at."""
    _attempts(database).let_go(worker, counted=True)


def _attempts(database: Database) -> Attempts:
    return Attempts(database, "photo", _set_aside)


def _set_aside(session: Session, photo: UUID, why: str) -> None:
    """Say in the gym's list of photos that this one is of no use."""
    reason = f"this photo could not be checked ({why}); take it back and send it again"
    change = update(Photo).where(Photo.id == photo, Photo.state == "received")
    session.execute(change.values(state="unusable", reason=reason[:500]))


def _claim(
    database: Database, worker: str, tried: ColumnElement[bool], most: int
) -> list[Photo]:  # fmt: skip
    """Begin a try of some photos: first each gym's oldest one, then each gym's second one.

    Parameters
    ----------
    tried : condition on earlier tries.
    """
    attempts = _attempts(database)
    turn = func.row_number().over(partition_by=Wall.gym_id, order_by=(Photo.created_at, Photo.id))
    waiting = (
        select(Photo.id)
        .join(_SCANS, _SCANS.c.id == Photo.scan_id)
        .join(Wall, Wall.id == _SCANS.c.wall_id)
        .outerjoin(JobAttempt, attempts.row_of(Photo.id))
        .where(Photo.state == "received", tried)
        .order_by(turn, Photo.created_at)
        .limit(most)
    )
    with database.reading() as session:
        ids = session.scalars(waiting).all()
    if not ids:
        return []
    mine = select(Photo).where(Photo.id.in_(ids), Photo.state == "received")
    with database.writing() as session:
        photos = session.scalars(mine.with_for_update(skip_locked=True)).all()
        return [photo for photo in photos if attempts.begin(session, photo.id, worker)]


def _look(database: Database, store: FileStore, photos: Sequence[Photo]) -> None:
    attempts = _attempts(database)
    with tempfile.TemporaryDirectory(prefix="walltopo-look-") as name:
        folder = Path(name)
        files = []
        for number, photo in enumerate(photos):
            with attempts.trying(photo.id):
                files.append((number, _fetched(store, photo, folder / str(number))))
        made = folder / "made"
        made.mkdir()
        with closing(decode_files(files, made, IngestSettings(), Silent())) as answers:
            for done in answers:
                photo = photos[done.number]
                with attempts.trying(photo.id):
                    _keep(database, store, photo, done, made)


def _fetched(store: FileStore, photo: Photo, path: Path) -> Path:
    file = path.with_suffix(suffix_of(photo.name))
    store.fetch(photo.original, file)
    return file


def _keep(database: Database, store: FileStore, photo: Photo, done: Done, made: Path) -> None:
    reason, note = "; ".join(done.reasons), ""
    facts: dict[str, object] = {}
    if done.photos:
        sharpest = max(done.photos, key=lambda stored: stored.sharpness)
        facts = {"width": sharpest.width, "height": sharpest.height,
                 "sharpness": sharpest.sharpness, "frames": len(done.photos)}  # fmt: skip
        shown = np.linspace(0, len(done.photos) - 1, min(len(done.photos), MOST_THUMBNAILS))
        for number, place in enumerate(shown.round().astype(int).tolist()):
            store.put(photo.thumbnail_of(number), _thumbnail(made / done.photos[place].file))
        for stored in done.photos:
            (made / stored.file).unlink()
        if sharpest.sharpness < LEAST_SHARPNESS:
            reason = "blurred"
        elif is_video(photo.name):
            # What was seen before the damage is as good as a shorter film.
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
        _attempts(database).end(session, photo.id)
        if state == "usable":
            ask(session, photo.scan_id)


def _thumbnail(path: Path) -> bytes:
    with open_picture(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((_THUMBNAIL, _THUMBNAIL))
    out = io.BytesIO()
    small.save(out, "JPEG", quality=80)
    return out.getvalue()
