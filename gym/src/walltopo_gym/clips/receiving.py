"""Clips from their announcement to the queue of their reading."""

from __future__ import annotations

from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from walltopo.reconstruct.ingest.sources import VIDEO_SUFFIXES
from walltopo_gym.accounts.limits import count_clip
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.service import CLIPS, ClipState, route_number
from walltopo_gym.database.engine import Database, take_turn
from walltopo_gym.errors import ConflictError, ContentError, RequestError
from walltopo_gym.jobs.queue import enqueue
from walltopo_gym.publishing.models import Route
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.scans.receiving import is_video
from walltopo_gym.storage.files import FileStore, hash_of_file
from walltopo_gym.walls.models import Wall


def check_video(name: str) -> None:
    """Refuse a file that is not a video by its name.

    Raises
    ------
    RequestError : it is not.
    """
    if not is_video(name):
        videos = ", ".join(sorted(suffix.lstrip(".").upper() for suffix in VIDEO_SUFFIXES))
        raise RequestError("clip-no-video", "clip-videos-are", videos=videos)


@dataclass(frozen=True)
class Announced:
    """A video's size in bytes, its hash if it is known, and whether a film of it is wanted."""

    size: int
    sha256: str | None
    wants_film: bool = False


def clip_to_receive(
    session: Session, route: Route, person: UUID, announced: Announced
) -> tuple[Clip, bool]:
    """Return the clip to receive, and whether it is new; one with the same content is the existing
    one, whose sender resumes.

    Raises
    ------
    ConflictError : the wall has no published version that shows the route.
    TooManyError : the limit of a day.
    """
    take_turn(session, f"clips {person}")
    if announced.sha256 is not None:
        same = select(Clip).where(Clip.person_id == person, Clip.route_id == route.id)
        same = same.where(Clip.sha256 == announced.sha256, Clip.size == announced.size)
        same = same.where(Clip.state != ClipState.UNREADABLE)  # which may be sent again
        found = session.scalars(same.order_by(Clip.created_at)).first()
        if found is not None:
            return found, False
    scan = session.get_one(Wall, route.wall_id).published_scan_id
    if scan is None or route_number(session, route.id, scan) is None:
        raise ConflictError("clip-no-scan")
    count_clip(session, person)
    clip = Clip(
        person_id=person,
        route_id=route.id,
        scan_id=scan,
        size=announced.size,
        sha256=announced.sha256,
        wants_film=announced.wants_film,
        state=ClipState.RECEIVING,
    )
    session.add(clip)
    session.flush()
    return clip, True


def announced_sizes(session: Session) -> dict[UUID, int]:
    """Return the sizes of announced clips that are not complete."""
    rows = select(Clip.id, Clip.size).where(Clip.state == ClipState.RECEIVING)
    return dict(session.execute(rows).all())


def finish_clip(
    database: Database, store: FileStore, incoming: Incoming, gym: UUID, clip: UUID
) -> None:
    """Store a complete clip and queue its reading; may be repeated at any point.

    Raises
    ------
    ContentError : its content is not what was announced; it is deleted.
    UnavailableError : the disk is too full to store it; its bytes stay.
    """
    with database.reading() as session:
        row = session.get(Clip, clip)
    if row is None:
        incoming.drop(clip)
        return
    try:
        content = hash_of_file(incoming.path(clip))
    except FileNotFoundError:
        return  # another request finished it
    if row.sha256 not in (None, content):
        incoming.drop(clip)
        with database.writing() as session:
            session.delete(session.get_one(Clip, clip))
        raise ContentError("clip-other-content", "clip-send-again")
    incoming.check_copy(clip)
    try:
        store.put(row.video, incoming.path(clip))
    except FileNotFoundError:
        return  # another request finished it
    with database.writing() as session:
        receiving = update(Clip).where(Clip.id == clip, Clip.state == ClipState.RECEIVING)
        session.execute(receiving.values(state=ClipState.SENT, sha256=content))
        # The job deletes the video if the clip was deleted meanwhile.
        enqueue(session, CLIPS, str(clip), gym=gym, key=f"clip-{clip}")
    incoming.drop(clip)
