"""Endpoints of photos and videos by tus 1.0.0 (`api/tus.py`): core, creation, termination.

A stored photo, recognised by its `sha256`, is not sent again, even after the tab was closed.
"""

from __future__ import annotations

from contextlib import ExitStack, suppress
from typing import Annotated
from uuid import UUID

from anyio import to_thread
from fastapi import APIRouter, BackgroundTasks, Header, Request, Response
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.responses import StreamingResponse

from walltopo_gym.api.fields import Digits
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.api.tus import Tus, check_content_type, read_metadata, write_body
from walltopo_gym.errors import (
    ConflictError,
    ContentError,
    NotFoundError,
    TooLargeError,
)
from walltopo_gym.gyms.access import Access
from walltopo_gym.scans.http.scans import UploaderMay
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.scans.models import Photo, PhotoOverlap, Scan
from walltopo_gym.scans.queues import photos_changed
from walltopo_gym.scans.quota import check_quota
from walltopo_gym.scans.receiving import (
    announced_sizes,
    finish_photo,
    is_video,
    kept_name,
    photo_to_receive,
)
from walltopo_gym.scans.service import State, scan_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["uploads"])


class PhotoOut(BaseModel):
    """A photo of a scan, or a video of so many `frames`; `reason`: why it is unusable, or why a
    video was not read to its end. `plate_frames`: in how many frames a scale plate was seen."""

    id: UUID
    name: str
    size: int
    state: str
    reason: str
    width: int | None
    height: int | None
    frames: int
    plate_frames: int


class ShiftOut(BaseModel):
    """How far the view moved from one photo to another that overlaps it: `right` and `up`, as a
    share of the picture's width and height; negative to the left and down."""

    before: UUID
    after: UUID
    right: float
    up: float


class OverlapOut(BaseModel):
    """Groups of overlapping photos: `groups` of ids, the largest first.

    `pending`: photos came or went, and the groups are being recomputed. `shifts` join the photos of
    each group, and have all consecutive photos that overlap. `gaps`: of each group but the largest
    one photo, and one of another group; another photo between the two would most likely join them.
    """

    pending: bool
    groups: list[list[UUID]]
    shifts: list[ShiftOut]
    gaps: list[list[UUID]]


@router.get("/gyms/{gym}/scans/{scan}/photos")
def list_photos(scan: UUID, session: Db, access: UploaderMay) -> list[PhotoOut]:
    """Return the photos of a scan in the order of their announcement."""
    row = scan_of(session, access.gym.id, scan)
    photos = select(Photo).where(Photo.scan_id == row.id).order_by(Photo.created_at, Photo.id)
    return [
        PhotoOut.model_validate(photo, from_attributes=True) for photo in session.scalars(photos)
    ]


@router.get("/gyms/{gym}/scans/{scan}/overlap")
def read_overlap(scan: UUID, session: Db, access: UploaderMay) -> OverlapOut:
    """Return the groups of overlapping photos. One group becomes the wall, the rest is left out."""
    row = session.get(PhotoOverlap, scan_of(session, access.gym.id, scan).id)
    if row is None:
        return OverlapOut(pending=False, groups=[], shifts=[], gaps=[])
    groups = [[UUID(photo) for photo in group] for group in row.groups]
    shifts = [ShiftOut.model_validate(shift) for shift in row.shifts]
    gaps = [[UUID(photo) for photo in gap] for gap in row.gaps]
    pending = row.answered < row.requested
    return OverlapOut(pending=pending, groups=groups, shifts=shifts, gaps=gaps)


@router.post("/gyms/{gym}/scans/{scan}/photos", status_code=201, dependencies=[Tus])
def announce_photo(
    scan: UUID,
    request: Request,
    response: Response,
    session: Db,
    services: ServicesOf,
    later: BackgroundTasks,
    access: UploaderMay,
    upload_length: Annotated[Digits, Header(ge=1, lt=2**63)],
    upload_metadata: Annotated[str, Header(max_length=2000)],
) -> None:
    """Announce a photo; `Location` is its address, `Upload-Offset` the number of stored bytes."""
    settings = services.settings
    metadata = read_metadata(upload_metadata)
    name = kept_name(metadata["filename"])
    kind, most = (
        ("video", settings.max_video_mb) if is_video(name) else ("photo", settings.max_photo_mb)
    )
    if upload_length > most * 1_000_000:
        raise TooLargeError("photo-too-large", kind=kind, most=most)
    row = scan_of(session, access.gym.id, scan)
    _check_open(row)
    photo, is_new = photo_to_receive(
        session, row.id, name, upload_length, metadata.get("sha256"), settings.max_photos
    )
    if is_new:
        check_quota(session, access.gym)
        others = announced_sizes(session)
        del others[photo.id]
        services.get(Incoming).begin(photo.id, upload_length, others)
    offset = _offset(services, photo)
    if photo.state == "receiving" and offset == photo.size:
        later.add_task(_finish_whole, services, photo.id)
    response.headers["location"] = f"{request.url.path.partition('/scans/')[0]}/photos/{photo.id}"
    response.headers["upload-offset"] = str(offset)


@router.head("/gyms/{gym}/photos/{photo}", dependencies=[Tus])
def ask_offset(
    photo: UUID,
    response: Response,
    session: Db,
    services: ServicesOf,
    later: BackgroundTasks,
    access: UploaderMay,
) -> None:
    """Return the number of stored bytes of a photo."""
    row = _photo_of(session, access, photo)
    offset = _offset(services, row)
    if row.state == "receiving" and offset == row.size:
        later.add_task(_finish_whole, services, row.id)
    response.headers["upload-offset"] = str(offset)
    response.headers["upload-length"] = str(row.size)
    response.headers["cache-control"] = "no-store"


@router.patch("/gyms/{gym}/photos/{photo}", status_code=204, dependencies=[Tus])
async def send_photo(
    photo: UUID,
    request: Request,
    response: Response,
    services: ServicesOf,
    access: UploaderMay,
    upload_offset: Annotated[Digits, Header(ge=0, lt=2**63)],
    content_type: Annotated[str, Header()],
) -> None:
    """Append bytes to a photo from `Upload-Offset` on; a complete photo is stored."""
    check_content_type(content_type)
    row = await to_thread.run_sync(_announced_photo, services, access, photo)
    if row.state == "receiving":
        with ExitStack() as stack:
            stream = stack.enter_context(services.get(Incoming).appending(photo, upload_offset))
            await write_body(
                request, services.get(Incoming).check_room, stream, row.size - upload_offset
            )
            await to_thread.run_sync(stack.pop_all().close)
    offset = _offset(services, row)
    if offset == row.size:
        arguments = (services.database, services.store, services.get(Incoming), photo)
        await to_thread.run_sync(finish_photo, *arguments)
    response.headers["upload-offset"] = str(offset)


@router.delete("/gyms/{gym}/photos/{photo}", status_code=204, dependencies=[Tus])
def drop_photo(photo: UUID, session: Db, services: ServicesOf, access: UploaderMay) -> None:
    """Delete a photo."""
    row = _photo_of(session, access, photo)
    scan = session.get_one(Scan, row.scan_id)
    _check_open(scan)
    scan.distance = None  # its points name photos by their numbers
    session.delete(row)
    photos_changed(session, row.scan_id)
    services.get(Incoming).drop(photo)


@router.get("/gyms/{gym}/photos/{photo}/thumbnail", response_class=StreamingResponse)
def read_thumbnail(
    photo: UUID, session: Db, services: ServicesOf, access: UploaderMay
) -> StreamingResponse:
    """Return a thumbnail of a photo, without its metadata."""
    row = _photo_of(session, access, photo)
    if row.sha256 is None or row.width is None:
        raise NotFoundError("photo-not-read")
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
        raise NotFoundError("not-there-photo")
    return row


def _check_open(scan: Scan) -> None:
    if scan.state not in (State.UPLOADING, State.FAILED, State.CANCELLED):
        raise ConflictError("scan-photos-stay", state=scan.state)


def _announced_photo(services: Services, access: Access, photo: UUID) -> Photo:
    """Return the photo that an upload sends; its scan must still accept photos."""
    with services.database.reading() as session:
        row = _photo_of(session, access, photo)
        _check_open(session.get_one(Scan, row.scan_id))
        return row


def _finish_whole(services: Services, photo: UUID) -> None:
    """Store a photo whose bytes were complete when database or store went away; its sender sends no
    more."""
    with suppress(ContentError):  # not what was announced: it is forgotten
        finish_photo(services.database, services.store, services.get(Incoming), photo)


def _offset(services: Services, photo: Photo) -> int:
    if photo.state != "receiving":
        return photo.size
    return services.get(Incoming).offset(photo.id)
