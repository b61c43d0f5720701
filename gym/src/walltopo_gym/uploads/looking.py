"""Looking at what came in: can it be read, is it sharp, was it sent before.

By walltopo's own ingest, in a child process that may die of what it is given. What others see is
made from the pixels alone: place, time and serial numbers stay in the original, which is private.
Of a video ingest takes the sharpest frame of each stretch of camera motion; here they are counted.
"""

from __future__ import annotations

import io
import tempfile
from contextlib import closing
from pathlib import Path
from typing import Final

import numpy as np
from sqlalchemy import select, update

from walltopo.core import Silent
from walltopo.images.files import open_picture
from walltopo.reconstruct.ingest.decode_job import Done
from walltopo.reconstruct.ingest.decoding import decode_files
from walltopo.reconstruct.ingest.image_file import LEAST_SHARPNESS
from walltopo.reconstruct.ingest.settings import IngestSettings
from walltopo_gym.database.engine import Database
from walltopo_gym.storage.files import FileStore
from walltopo_gym.uploads.models import MOST_THUMBNAILS, Photo
from walltopo_gym.uploads.overlap import ask
from walltopo_gym.uploads.receiving import is_video, suffix_of

__all__ = ["look_at_some"]

_AT_ONCE: Final = 16
_THUMBNAIL: Final = 480


def look_at_some(database: Database, store: FileStore) -> int:
    """Look at photos that nobody looked at yet; how many. May be cut short at any point."""
    with database.reading() as session:
        waiting = select(Photo).where(Photo.state == "received").order_by(Photo.created_at)
        photos = list(session.scalars(waiting.limit(_AT_ONCE)))
    if not photos:
        return 0
    with tempfile.TemporaryDirectory(prefix="walltopo-look-") as name:
        folder = Path(name)
        files = [(number, _fetched(store, photo, folder / str(number)))
                 for number, photo in enumerate(photos)]  # fmt: skip
        made = folder / "made"
        made.mkdir()
        with closing(decode_files(files, made, IngestSettings(), Silent())) as answers:
            for done in answers:
                _keep(database, store, photos[done.number], done, made)
    return len(photos)


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
        if state == "usable":
            ask(session, photo.scan_id)


def _thumbnail(path: Path) -> bytes:
    with open_picture(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((_THUMBNAIL, _THUMBNAIL))
    out = io.BytesIO()
    small.save(out, "JPEG", quality=80)
    return out.getvalue()
