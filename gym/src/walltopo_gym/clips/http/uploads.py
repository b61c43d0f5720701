"""Endpoints that receive clips by tus 1.0.0 (`api/tus.py`): core and creation."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from typing import Annotated
from uuid import UUID

from anyio import to_thread
from fastapi import APIRouter, BackgroundTasks, Header, Query, Request, Response

from walltopo_gym.api.fields import Digits
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.api.tus import Tus, check_content_type, read_metadata, write_body
from walltopo_gym.clips.films import check_films
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.receiving import (
    Announced,
    announced_sizes,
    check_video,
    clip_to_receive,
    finish_clip,
)
from walltopo_gym.clips.service import ClipState, clip_of
from walltopo_gym.errors import ContentError, TooLargeError
from walltopo_gym.gyms.access import Access, gym_rule
from walltopo_gym.gyms.members import check_not_banned
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.versions import route_of
from walltopo_gym.scans.incoming import Incoming

router = APIRouter(tags=["clips"])

ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]


@router.post("/gyms/{gym}/routes/{route}/clips", status_code=201)
def announce_clip(
    route: UUID,
    request: Request,
    response: Response,
    session: Db,
    services: ServicesOf,
    later: BackgroundTasks,
    access: ClimberMay,
    upload_length: Annotated[Digits, Header(ge=1, lt=2**63)],
    upload_metadata: Annotated[str, Header(max_length=2000)],
    film: Annotated[bool, Query(description="make a film that may be published")] = False,
    _: None = Tus,
) -> None:
    """Announce a clip of an attempt; `Location` is its address, `Upload-Offset` the number of
    stored bytes."""
    metadata = read_metadata(upload_metadata)
    check_video(metadata["filename"])
    most = services.settings.max_clip_mb
    if upload_length > most * 1_000_000:
        raise TooLargeError("clip-too-large", most=most)
    me = access.actor.known
    check_not_banned(session, access.gym.id, me)
    row = route_of(session, access.gym.id, route)
    if film:
        check_films(session, access.gym, me, services.settings.features)
    announced = Announced(upload_length, metadata.get("sha256"), film)
    clip, is_new = clip_to_receive(session, row, me, announced)
    if is_new:
        others = announced_sizes(session)
        del others[clip.id]
        _incoming(services).begin(clip.id, upload_length, others)
    _finish_later(services, access, clip, later)
    response.headers["location"] = f"{request.url.path.partition('/routes/')[0]}/clips/{clip.id}"
    response.headers["upload-offset"] = str(_received_bytes(services, clip))


@router.head("/gyms/{gym}/clips/{clip}")
def ask_clip_offset(
    clip: UUID,
    response: Response,
    session: Db,
    services: ServicesOf,
    later: BackgroundTasks,
    access: ClimberMay,
    _: None = Tus,
) -> None:
    """Return the number of stored bytes of one's own clip."""
    row = clip_of(session, access.gym.id, clip, access.actor.known)
    _finish_later(services, access, row, later)
    response.headers["upload-offset"] = str(_received_bytes(services, row))
    response.headers["upload-length"] = str(row.size)
    response.headers["cache-control"] = "no-store"


@router.patch("/gyms/{gym}/clips/{clip}", status_code=204)
async def send_clip(
    clip: UUID,
    request: Request,
    response: Response,
    services: ServicesOf,
    access: ClimberMay,
    upload_offset: Annotated[Digits, Header(ge=0, lt=2**63)],
    content_type: Annotated[str, Header()],
    _: None = Tus,
) -> None:
    """Append bytes to one's own clip from `Upload-Offset` on; a complete clip is read."""
    check_content_type(content_type)
    row = await to_thread.run_sync(_own_clip, services, access, clip)
    incoming = _incoming(services)
    if row.state == ClipState.RECEIVING:
        with ExitStack() as stack:
            stream = stack.enter_context(incoming.appending(clip, upload_offset))
            await write_body(request, incoming.check_room, stream, row.size - upload_offset)
            await to_thread.run_sync(stack.pop_all().close)
    offset = _received_bytes(services, row)
    if row.state == ClipState.RECEIVING and offset == row.size:
        await to_thread.run_sync(_queue_reading, services, access, clip)
    response.headers["upload-offset"] = str(offset)


def _incoming(services: Services) -> Incoming:
    return services.get(Incoming).beside("clips")


def _own_clip(services: Services, access: Access, clip: UUID) -> Clip:
    with services.database.reading() as session:
        return clip_of(session, access.gym.id, clip, access.actor.known)


def _received_bytes(services: Services, clip: Clip) -> int:
    if clip.state != ClipState.RECEIVING:
        return clip.size
    return _incoming(services).offset(clip.id)


def _queue_reading(services: Services, access: Access, clip: UUID) -> None:
    incoming = _incoming(services)
    finish_clip(services.database, services.store, incoming, access.gym.id, clip)


def _finish_later(services: Services, access: Access, clip: Clip, later: BackgroundTasks) -> None:
    """Finish a clip whose bytes were complete when database or store went away; its sender sends no
    more."""

    def finish() -> None:
        with suppress(ContentError):  # not what was announced: it is forgotten
            _queue_reading(services, access, clip.id)

    if clip.state == ClipState.RECEIVING and _received_bytes(services, clip) == clip.size:
        later.add_task(finish)
