"""Photos from their announcement to their place in the store."""

from __future__ import annotations

import logging
import unicodedata
from pathlib import PurePosixPath
from uuid import UUID

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from walltopo.reconstruct.ingest.sources import PHOTO_SUFFIXES, VIDEO_SUFFIXES
from walltopo_gym.database.engine import Database, take_turn
from walltopo_gym.errors import ConflictError, ContentError, RequestError
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.scans.models import Photo
from walltopo_gym.scans.queues import photos_changed, queue_batch
from walltopo_gym.storage.files import FileStore, hash_of_file

_LOG = logging.getLogger("walltopo_gym.scans")

_LONGEST_NAME = 120


def suffix_of(name: str) -> str:
    """Return the suffix of a photo's or video's name, such as ".jpg".

    Raises
    ------
    RequestError : the format is not supported.
    """
    suffix = PurePosixPath(name.replace("\\", "/")).suffix.lower()
    if suffix not in PHOTO_SUFFIXES | VIDEO_SUFFIXES:
        photos, videos = (
            ", ".join(sorted(kind.lstrip(".").upper() for kind in kinds))
            for kinds in (PHOTO_SUFFIXES, VIDEO_SUFFIXES)
        )
        raise RequestError(
            "no-photo-by-name", "photos-are", name=name, photos=photos, videos=videos
        )
    return suffix


def is_video(name: str) -> bool:
    """Return whether a name is a video's."""
    return suffix_of(name) in VIDEO_SUFFIXES


def photo_to_receive(
    session: Session, scan: UUID, name: str, size: int, sha256: str | None, most: int
) -> tuple[Photo, bool]:
    """Return the photo to receive, and whether it is new.

    A photo whose content the scan has already, or whose upload was begun before (the tab was
    closed), is the existing one; its sender resumes.

    Raises
    ------
    RequestError : the name is not a photo's; ConflictError : the scan has `most` photos.
    """
    name = kept_name(name)
    take_turn(session, f"photos {scan}")
    mine = select(Photo).where(Photo.scan_id == scan)
    if sha256 is not None:
        same = mine.where(Photo.sha256 == sha256, Photo.size == size)
        found = session.scalars(same.order_by(Photo.created_at)).first()
        if found is not None:
            return found, False
    if (session.scalar(select(func.count()).select_from(mine.subquery())) or 0) >= most:
        raise ConflictError("photos-most", "leave-out-same", most=most)
    photo = Photo(scan_id=scan, name=name, size=size, state="receiving", sha256=sha256)
    session.add(photo)
    session.flush()
    return photo, True


def announced_sizes(session: Session) -> dict[UUID, int]:
    """Return the sizes of announced photos that are not complete."""
    rows = select(Photo.id, Photo.size).where(Photo.state == "receiving")
    return dict(session.execute(rows).all())


def finish_photo(database: Database, store: FileStore, incoming: Incoming, photo: UUID) -> None:
    """Store a complete photo; may be repeated at any point.

    Raises
    ------
    ContentError : its content is not what was announced; it is deleted.
    UnavailableError : the disk is too full to store it; its bytes stay.
    """
    path = incoming.path(photo)
    with database.reading() as session:
        row = session.get(Photo, photo)
    if row is None:
        return  # it was taken back
    try:
        content = hash_of_file(path)
    except FileNotFoundError:
        return  # somebody else finished it, or it was taken back
    if row.sha256 not in (None, content):
        incoming.drop(photo)
        with database.writing() as session:
            session.delete(session.get_one(Photo, photo))
            photos_changed(session, row.scan_id)
        raise ContentError("content-other", "send-again", name=row.name)
    key = f"originals/{content}"
    incoming.check_copy(photo)
    try:
        store.put(key, path)  # also where it is already: a purge leaves young files alone
    except FileNotFoundError:
        return  # another server has finished it
    with database.writing() as session:
        received = update(Photo).where(Photo.id == photo, Photo.state == "receiving")
        session.execute(received.values(state="received", sha256=content))
        queue_batch(session, row.scan_id)
    incoming.drop(photo)


def finish_all(database: Database, store: FileStore, incoming: Incoming) -> None:
    """Store the photos that were complete when a server was killed, and tidy up after it. A photo
    that cannot be stored keeps its bytes: its sender asks again."""
    with database.reading() as session:
        sizes = announced_sizes(session)
    whole = [photo for photo, size in sizes.items() if incoming.offset(photo) == size]
    for photo in incoming.photos() - sizes.keys():
        incoming.drop(photo)
    for photo in whole:
        try:
            finish_photo(database, store, incoming, photo)
        except ContentError as error:  # not what was announced: its sender finds no such photo
            _LOG.info("photo %s: %s", photo, error)
        except Exception:  # the server starts all the same
            _LOG.exception("photo %s cannot be finished", photo)


def kept_name(name: str) -> str:
    """Return the name under which a photo or video is stored; its suffix gives the format.

    Raises
    ------
    RequestError : the format is not supported.
    """
    kept = shown_name(name)
    suffix_of(kept)
    return kept


def shown_name(name: str) -> str:
    """Return the last part of a name, without control characters."""
    last = unicodedata.normalize("NFC", name).replace("\\", "/").rpartition("/")[2]
    kept = "".join(c if c.isprintable() else "_" for c in last)
    return kept[-_LONGEST_NAME:]
