"""The demo's clip of an attempt, sent by the demo climber as a phone would; the worker reads it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clips.receiving import Announced, clip_to_receive, finish_clip
from walltopo_gym.clips.service import ClipState
from walltopo_gym.database.engine import Database
from walltopo_gym.publishing.models import Route
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, hash_of_file
from walltopo_gym.walls.models import Wall


@dataclass(frozen=True)
class DemoClip:
    """A video, the name of the wall that it shows, and the colour of the route."""

    video: Path
    wall: str
    colour: str


def send_clip(
    settings: GymSettings,
    database: Database,
    store: FileStore,
    to: tuple[UUID, UUID],
    clip: DemoClip,
) -> None:
    """Send a clip, unless it was sent before, this server has no clips, or the wall no route of the
    colour.

    Parameters
    ----------
    to : the demo gym and its climber.
    """
    if "clips" not in settings.features:
        return
    gym, climber = to
    incoming = Incoming(settings.data / "incoming", settings.keep_free_mb).beside("clips")
    with database.writing() as session:
        route = _route_of_clip(session, gym, clip)
        if route is None:
            return
        announced = Announced(clip.video.stat().st_size, hash_of_file(clip.video), wants_film=True)
        row, _ = clip_to_receive(session, route, climber, announced)
    if row.state != ClipState.RECEIVING:
        return
    incoming.store_whole(row.id, clip.video)
    finish_clip(database, store, incoming, gym, row.id)


def _route_of_clip(session: Session, gym: UUID, clip: DemoClip) -> Route | None:
    wanted = (
        select(Route)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym, Wall.name == clip.wall, Route.colour == clip.colour)
        .where(Route.stripped_at.is_(None))
    )
    return session.scalars(wanted.order_by(Route.created_at, Route.id)).first()
