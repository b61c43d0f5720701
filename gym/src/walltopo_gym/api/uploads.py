"""Photos and videos by tus 1.0.0 (https://tus.io/protocols/resumable-upload): core, creation,
termination.

A phone announces a photo (POST), sends it (PATCH), and after whatever went wrong asks how much is
here (HEAD) and goes on. `Upload-Metadata` has `filename` and, where the phone can, `sha256`: a
photo that is here already is then not sent twice, also after the tab was closed.
"""

from __future__ import annotations

import base64
import binascii
from contextlib import ExitStack, suppress
from typing import IO, Annotated, Final
from uuid import UUID

from anyio import to_thread
from fastapi import APIRouter, BackgroundTasks, Depends, Header, HTTPException, Request, Response
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import ClientDisconnect
from starlette.responses import StreamingResponse

from walltopo.core import InputError
from walltopo_gym.api.rules import Access
from walltopo_gym.api.scans import UploaderMay, scan_of
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import State
from walltopo_gym.uploads.incoming import Incoming
from walltopo_gym.uploads.models import Photo, PhotoOverlap
from walltopo_gym.uploads.overlap import ask
from walltopo_gym.uploads.receiving import announce, announced_sizes, finish, is_video, kept_name

_VERSION: Final = "1.0.0"
_PIECE: Final = 1 << 20
_LONGEST_PHOTO: Final = 2_000_000_000  # what can be announced at most, by the settings


def _speak_tus(response: Response, tus_resumable: Annotated[str | None, Header()] = None) -> None:
    """Every request says which version it speaks, and so does every answer."""
    response.headers["tus-resumable"] = _VERSION
    if tus_resumable != _VERSION:
        raise HTTPException(
            412, f"Tus-Resumable: expected {_VERSION}, got {tus_resumable}",
            {"tus-version": _VERSION},
        )  # fmt: skip


router = APIRouter(tags=["uploads"])
Tus = Depends(_speak_tus)


class PhotoFacts(BaseModel):
    """A photo of a scan, or a video of so many `frames`; `reason` says why it is of no
    use, or why a video was not seen to its end."""

    id: UUID
    name: str
    size: int
    state: str
    reason: str
    width: int | None
    height: int | None
    frames: int


class OverlapFacts(BaseModel):
    """Which photos hang together by what they show; `groups` of their ids, the largest first.

    `pending`: photos came or went since, and it is being found out anew.
    """

    pending: bool
    groups: list[list[UUID]]


@router.get("/gyms/{gym}/scans/{scan}/photos")
def list_photos(scan: UUID, session: Db, access: UploaderMay) -> list[PhotoFacts]:
    """The photos of a scan, in the order in which they were announced."""
    row = scan_of(session, access.gym.id, scan)
    photos = select(Photo).where(Photo.scan_id == row.id).order_by(Photo.created_at, Photo.id)
    return [PhotoFacts.model_validate(photo, from_attributes=True)
            for photo in session.scalars(photos)]  # fmt: skip


@router.get("/gyms/{gym}/scans/{scan}/overlap")
def read_overlap(scan: UUID, session: Db, access: UploaderMay) -> OverlapFacts:
    """Which usable photos overlap: what hangs together becomes one wall, the rest is left out."""
    row = session.get(PhotoOverlap, scan_of(session, access.gym.id, scan).id)
    if row is None:
        return OverlapFacts(pending=False, groups=[])
    groups = [[UUID(photo) for photo in group] for group in row.groups]
    return OverlapFacts(pending=row.answered < row.asked, groups=groups)


@router.post("/gyms/{gym}/scans/{scan}/photos", status_code=201, dependencies=[Tus])
def announce_photo(
    scan: UUID, request: Request, response: Response, session: Db, services: ServicesOf,
    later: BackgroundTasks, access: UploaderMay,
    upload_length: Annotated[int, Header(ge=1, lt=2**63)],
    upload_metadata: Annotated[str, Header(max_length=2000)],
) -> None:  # fmt: skip
    """Announce a photo; `Location` is where it goes, `Upload-Offset` how much is here already."""
    settings = services.settings
    told = _metadata(upload_metadata)
    name = kept_name(told["filename"])
    kind, most = ("video", settings.most_video_mb) if is_video(name) else (
        "photo", settings.most_photo_mb
    )  # fmt: skip
    if upload_length > most * 1_000_000:
        raise HTTPException(413, f"a {kind} has at most {most} MB")
    row = scan_of(session, access.gym.id, scan)
    _check_open(row)
    photo, is_new = announce(
        session, row.id, name, upload_length, told.get("sha256"), settings.most_photos
    )
    if is_new:
        others = announced_sizes(session)
        del others[photo.id]
        services.incoming.begin(photo.id, upload_length, others)
    offset = _offset(services, photo)
    if photo.state == "receiving" and offset == photo.size:
        later.add_task(_finish_whole, services, photo.id)
    response.headers["location"] = f"{request.url.path.partition('/scans/')[0]}/photos/{photo.id}"
    response.headers["upload-offset"] = str(offset)


@router.head("/gyms/{gym}/photos/{photo}", dependencies=[Tus])
def ask_offset(
    photo: UUID, response: Response, session: Db, services: ServicesOf, later: BackgroundTasks,
    access: UploaderMay,
) -> None:  # fmt: skip
    """How much of a photo is here."""
    row = _photo_of(session, access, photo)
    offset = _offset(services, row)
    if row.state == "receiving" and offset == row.size:
        later.add_task(_finish_whole, services, row.id)
    response.headers["upload-offset"] = str(offset)
    response.headers["upload-length"] = str(row.size)
    response.headers["cache-control"] = "no-store"


@router.patch(
    "/gyms/{gym}/photos/{photo}", status_code=204, dependencies=[Tus], max_body_size=_LONGEST_PHOTO
)
async def send_photo(
    photo: UUID, request: Request, response: Response, services: ServicesOf, access: UploaderMay,
    upload_offset: Annotated[int, Header(ge=0, lt=2**63)],
    content_type: Annotated[str, Header()],
) -> None:  # fmt: skip
    """Send a photo's bytes from `Upload-Offset` on; when all are here it is stored."""
    if content_type != "application/offset+octet-stream":
        raise HTTPException(415, "Content-Type: expected application/offset+octet-stream")
    row = await to_thread.run_sync(_to_send, services, access, photo)
    if row.state == "receiving":
        with ExitStack() as stack:
            stream = stack.enter_context(services.incoming.appending(photo, upload_offset))
            await _receive(request, services.incoming, stream, row.size - upload_offset)
            await to_thread.run_sync(stack.pop_all().close)
    offset = _offset(services, row)
    if offset == row.size:
        arguments = (services.database, services.store, services.incoming, photo)
        await to_thread.run_sync(finish, *arguments)
    response.headers["upload-offset"] = str(offset)


@router.delete("/gyms/{gym}/photos/{photo}", status_code=204, dependencies=[Tus])
def drop_photo(photo: UUID, session: Db, services: ServicesOf, access: UploaderMay) -> None:
    """Take a photo back."""
    row = _photo_of(session, access, photo)
    _check_open(session.get_one(Scan, row.scan_id))
    session.delete(row)
    ask(session, row.scan_id)
    services.incoming.drop(photo)


@router.get("/gyms/{gym}/photos/{photo}/thumbnail", response_class=StreamingResponse)
def read_thumbnail(
    photo: UUID, session: Db, services: ServicesOf, access: UploaderMay
) -> StreamingResponse:
    """A small picture of the photo, of its pixels alone."""
    row = _photo_of(session, access, photo)
    if row.sha256 is None or row.width is None:
        raise NotFoundError("nobody has looked at this photo yet, or it cannot be read")
    headers = {"etag": f'"{row.sha256}"', "cache-control": "private, max-age=31536000, immutable"}
    pieces = services.store.chunks(row.thumbnail)
    return StreamingResponse(pieces, media_type="image/jpeg", headers=headers)


def _photo_of(session: Session, access: Access, photo: UUID) -> Photo:
    found = (
        select(Photo)
        .join(Scan, Scan.id == Photo.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Photo.id == photo, Wall.gym_id == access.gym.id)
    )
    row = session.scalar(found)
    if row is None:
        raise NotFoundError("no such photo")
    return row


def _check_open(scan: Scan) -> None:
    if scan.state not in (State.UPLOADING, State.FAILED, State.CANCELLED):
        raise ConflictError(f"the scan is {scan.state}; its photos stay as they are")


def _to_send(services: Services, access: Access, photo: UUID) -> Photo:
    with services.database.reading() as session:
        row = _photo_of(session, access, photo)
        _check_open(session.get_one(Scan, row.scan_id))
        return row


def _finish_whole(services: Services, photo: UUID) -> None:
    """All of it had come when the database, or the store, went away: its sender sends no more."""
    with suppress(InputError):  # not what was announced: it is forgotten
        finish(services.database, services.store, services.incoming, photo)


def _offset(services: Services, photo: Photo) -> int:
    if photo.state != "receiving":
        return photo.size
    return services.incoming.offset(photo.id)


async def _receive(request: Request, incoming: Incoming, stream: IO[bytes], most: int) -> None:
    """Write the body down as it comes. A connection that breaks leaves what came before.

    Raises
    ------
    EnvironmentLacksError : the disk has become too full; what came before is kept.
    """
    held = bytearray()

    def write(piece: bytes) -> None:
        for start in range(0, len(piece), _PIECE):
            part = piece[start : start + _PIECE]
            incoming.check_room(len(part))
            stream.write(part)
            stream.flush()

    try:
        async for piece in request.stream():
            held += piece
            most -= len(piece)
            if most < 0:
                raise HTTPException(413, "more bytes than were announced")
            if len(held) >= _PIECE:
                await to_thread.run_sync(write, bytes(held))
                held.clear()
    except ClientDisconnect:
        pass  # what came is kept; nobody is there to be told
    if most >= 0:
        await to_thread.run_sync(write, bytes(held))


def _metadata(header: str) -> dict[str, str]:
    """`Upload-Metadata`: keys with values in base64, between commas.

    Raises
    ------
    InputError : not of that shape, no file name, a hash that is none.
    """
    told = {}
    for pair in header.split(","):
        key, _, value = pair.strip().partition(" ")
        try:
            told[key] = base64.b64decode(value, validate=True).decode()
        except (binascii.Error, UnicodeDecodeError) as error:
            raise InputError(f"Upload-Metadata: {key[:40]!r} is no text in base64") from error
    if not told.get("filename"):
        raise InputError("Upload-Metadata: filename is missing")
    digest = told.get("sha256")
    if digest is not None and (len(digest) != 64 or set(digest) - set("0123456789abcdef")):
        raise InputError("Upload-Metadata: sha256 is not 64 hex digits")
    return told
