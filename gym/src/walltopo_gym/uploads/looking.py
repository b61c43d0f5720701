"""Looking at photos that came in: can they be read, are they sharp, were they sent before.

By walltopo's own ingest, in a child process that may die of what it is given. What others see is
made from the pixels alone: place, time and serial numbers stay in the original, which is private.
"""

from __future__ import annotations

import io
import tempfile
from contextlib import closing
from pathlib import Path
from typing import Final

from sqlalchemy import select, update

from walltopo.core import Silent
from walltopo.imaging.opening import open_picture
from walltopo.photos.contract import IngestSettings
from walltopo.photos.decoding import decode_files
from walltopo.photos.job import Done
from walltopo.photos.quality import LEAST_SHARPNESS
from walltopo_gym.database.engine import Database
from walltopo_gym.storage.files import FileStore
from walltopo_gym.uploads.models import Photo
from walltopo_gym.uploads.receiving import suffix_of

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
    reason = "; ".join(done.reasons)
    facts: dict[str, object] = {}
    if done.photos:
        stored = done.photos[0]
        facts = {"width": stored.width, "height": stored.height, "sharpness": stored.sharpness}
        store.put(photo.thumbnail, _thumbnail(made / stored.file))
        if stored.sharpness < LEAST_SHARPNESS:
            reason = "blurred"
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
        session.execute(change.values(state=state, reason=reason[:500], **facts))


def _thumbnail(path: Path) -> bytes:
    with open_picture(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((_THUMBNAIL, _THUMBNAIL))
    out = io.BytesIO()
    small.save(out, "JPEG", quality=80)
    return out.getvalue()
