"""The job that reads clips, one at a time of a worker, and deletes their videos."""

from __future__ import annotations

import logging
import tempfile
import threading
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import Any, Final
from uuid import UUID

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from walltopo.scans.folder import ScanFolder
from walltopo_gym.clips.child import Limits, WithdrawnError, read_in_child
from walltopo_gym.clips.films import forget_old_films
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.reader import Fault, Found, Phase, ReadRequest, Refused
from walltopo_gym.clips.service import CLIPS, MAX_SECONDS, PENDING, ClipState, route_number
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.jobs.queue import Failure, enqueue
from walltopo_gym.publishing.models import Route
from walltopo_gym.scans.artifacts import download_wall, upload_landmarks
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, open_store
from walltopo_gym.walls.models import Wall

_LOG = logging.getLogger("walltopo_gym.clips")
_OVER_S: Final = 1.0  # phones stop a little late
_GIVEN_UP: Final = timedelta(days=1)  # without its last byte


@dataclass(frozen=True)
class ClipReadings:
    """The job that reads a clip."""

    settings: GymSettings
    database: Database
    store: FileStore
    stopping: threading.Event = field(default_factory=threading.Event)

    def read(self, clip: str) -> None:
        """Read a clip and delete its video; only delete it if the clip is not to be read."""
        one = UUID(clip)
        with self.database.writing() as session:
            row = _claim_clip(session, one)
            number = None if row is None else route_number(session, row.route_id, row.scan_id)
        if row is not None:
            try:
                found, film = (
                    (Refused("no-route"), None) if number is None else self._read(row, number)
                )
                with self.database.writing() as session:
                    _store_result(session, one, found, film)
            except WithdrawnError:
                _LOG.info("clip %s was deleted while it was read", clip)
        self.store.drop([f"clips/{one}"])

    def _read(self, row: Clip, number: int) -> tuple[Found | Refused, int | None]:
        """Return the answer, and the size of the film that was stored."""
        with tempfile.TemporaryDirectory() as name:
            video, folder = Path(name) / "video", ScanFolder(Path(name) / "scan")
            film = Path(name) / "film.mp4"
            self.store.fetch(row.video, video)
            download_wall(self.store, row.scan_id, folder)
            request = ReadRequest(
                str(video), str(folder.root), number, MAX_SECONDS + _OVER_S,
                str(film) if row.wants_film else "",
            )  # fmt: skip
            limits = Limits(
                self.settings.clip_minutes * 60, self.settings.clip_memory_mb, self.stopping
            )
            found = read_in_child(request, limits, lambda phase: self._report(row.id, phase))
            upload_landmarks(self.store, row.scan_id, folder)
            if not isinstance(found, Found) or not film.is_file():
                return found, None
            self.store.put(row.film, film)
            return found, film.stat().st_size

    def _report(self, clip: UUID, phase: Phase) -> bool:
        """Store the present step; return False if the clip was deleted."""
        with self.database.writing() as session:
            return _lock_unread_clip(
                session, clip, phase=phase.name, done=phase.done, total=phase.total
            )


def record_failure(session: Session, failure: Failure, clip: str) -> None:
    """After the last try, mark the clip as unreadable, and queue the deletion of its video."""
    if failure.again_at is not None:
        return
    row = session.get(Clip, UUID(clip))
    if row is not None:
        _store_result(session, row.id, Refused("failed"))
        enqueue(session, CLIPS, clip, gym=gym_of(session, row.route_id))


def gym_of(session: Session, route: UUID) -> UUID:
    """Return the gym of a route that exists."""
    found = select(Wall.gym_id).join(Route, Route.wall_id == Wall.id).where(Route.id == route)
    return session.scalars(found).one()


def tidy(settings: GymSettings, database: Database) -> None:
    """Delete clips whose last byte never came, videos and pieces that no clip waits for, and films
    that nobody published in time or that were removed."""
    incoming = Incoming(settings.data / "incoming", settings.keep_free_mb).beside("clips")
    store = open_store(settings)
    # Before the rows: new ones stay.
    pieces, videos, films = incoming.photos(), store.keys("clips/"), store.keys("films/")
    before = now() - _GIVEN_UP
    with database.writing() as session:
        receiving = Clip.state == ClipState.RECEIVING
        session.execute(delete(Clip).where(receiving, Clip.created_at < before))
        wanted = set(session.scalars(select(Clip.id).where(Clip.state.in_(PENDING) | receiving)))
        forget_old_films(session)
        session.flush()
        shown = set(session.scalars(select(Clip.id).where(Clip.film_size.is_not(None))))
    for piece in pieces - wanted:
        incoming.drop(piece)
    # A clip that is still being read has its film in the store before it has a size.
    kept = {f"clips/{one}" for one in wanted} | {f"films/{one}" for one in wanted | shown}
    store.drop([key for key in videos + films if key not in kept])


def _claim_clip(session: Session, clip: UUID) -> Clip | None:
    """Mark a clip as being read and return it; None if it was deleted or is read."""
    if not _lock_unread_clip(session, clip, state=ClipState.READING, phase="", done=0, total=None):
        return None
    return session.get(Clip, clip)


def _lock_unread_clip(session: Session, clip: UUID, **values: Any) -> bool:
    """Change a clip that is sent or being read; return whether it is."""
    pending = update(Clip).where(Clip.id == clip, Clip.state.in_(PENDING))
    return session.scalar(pending.values(**values).returning(Clip.id)) is not None


def _store_result(
    session: Session, clip: UUID, found: Found | Refused, film: int | None = None
) -> None:
    if isinstance(found, Refused):
        fault: Fault = found.fault
        _lock_unread_clip(session, clip, state=ClipState.UNREADABLE, fault=fault)
    else:
        values = {"attempt": found.attempt, "holds": found.holds, "phase": "", "film_size": film}
        _lock_unread_clip(session, clip, state=ClipState.READ, **values)
