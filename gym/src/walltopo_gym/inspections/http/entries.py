"""Endpoints of entries and their photos, which phones send when they have reception."""

from __future__ import annotations

from typing import Annotated
from uuid import UUID

from anyio import to_thread
from fastapi import APIRouter, Path, Request, Response
from pydantic import BaseModel, Field

from walltopo_gym.api.fields import Body, Note
from walltopo_gym.api.services import Services, ServicesOf
from walltopo_gym.climbing.ascents import EditOriginIn
from walltopo_gym.errors import RequestError
from walltopo_gym.gyms.access import Access, SetterMay
from walltopo_gym.gyms.models import Gym
from walltopo_gym.inspections.entries import HoldMark, ItemMark, Mark, store_entry
from walltopo_gym.inspections.http.inspections import InspectionEntryOut
from walltopo_gym.inspections.http.plans import InspectorMay
from walltopo_gym.inspections.models import InspectedWall
from walltopo_gym.inspections.photos import has_photo, read_photo, store_photo
from walltopo_gym.inspections.record import entry_facts, names_of
from walltopo_gym.inspections.service import inspection_of
from walltopo_gym.publishing.version_holds import version_holds
from walltopo_gym.scans.quota import check_quota

router = APIRouter(tags=["inspections"])

_HASH = r"^[0-9a-f]{64}$"
PhotoName = Annotated[str, Path(pattern=_HASH)]


class NewInspectionEntry(Body):
    """A mark of an item of the checklist (`item`, its number from 0: "fine", "defect" with a note,
    "unchecked") or of a hold (`hold`: "fine", "tightened", "washed", "removed") at a wall.

    `photo`: the name of a photo that was sent before. `edit`: with its age on arrival.
    """

    wall_id: UUID
    item: int | None = Field(None, ge=0, le=1000)
    hold: int | None = Field(None, ge=1, le=65535)
    mark: ItemMark | HoldMark
    note: Note = ""
    photo: str | None = Field(None, pattern=_HASH)
    edit: EditOriginIn | None = None


class InspectionPhotoOut(BaseModel):
    """A stored photo by its name, which an entry gives."""

    photo: str


class InspectionPhoto(Response):
    media_type = "image/jpeg"


@router.put("/gyms/{gym}/inspections/{inspection}/entries/{entry}")
def put_inspection_entry(
    inspection: UUID,
    entry: UUID,
    body: NewInspectionEntry,
    response: Response,
    services: ServicesOf,
    access: SetterMay,
) -> InspectionEntryOut:
    """Mark an item or a hold under an id that the phone made, so that it is stored once. A mark
    that arrives after the inspection was finished is kept as late."""
    gym, me = access.gym.id, access.actor.known
    with services.database.reading() as session:
        row = inspection_of(session, gym, inspection)
        inspected = session.get(InspectedWall, (row.id, body.wall_id))
        scan = None if inspected is None or body.hold is None else inspected.scan_id
    holds = {} if scan is None else version_holds(services.store, scan).by_id
    if body.photo is not None and not has_photo(services.store, row, body.photo):
        raise RequestError("inspection-photo-unknown")
    mark = _mark_in(body)
    with services.database.writing() as session:
        row = inspection_of(session, gym, inspection, locked=True)
        stored, is_new = store_entry(session, row, entry, me, mark, holds)
        facts = entry_facts(stored, names_of(session, row, [stored]))
        answer = InspectionEntryOut(**facts, late=stored.late)
    response.status_code = 201 if is_new else 200
    return answer


def _mark_in(body: NewInspectionEntry) -> Mark:
    # "fine" is a mark of both kinds.
    kind = ItemMark if body.hold is None else HoldMark
    if body.mark.value not in {mark.value for mark in kind}:
        raise RequestError("inspection-mark-unknown")
    return Mark(
        wall=body.wall_id,
        item=body.item,
        hold=body.hold,
        mark=kind(body.mark.value),
        note=body.note,
        photo=body.photo,
        edit=None if body.edit is None else body.edit.read(),
    )


@router.post(
    "/gyms/{gym}/inspections/{inspection}/photos",
    status_code=201,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                kind: {"schema": {"type": "string", "format": "binary"}}
                for kind in ("image/jpeg", "image/png", "image/webp")
            },
        }
    },
)
async def send_inspection_photo(
    inspection: UUID, request: Request, services: ServicesOf, access: SetterMay
) -> InspectionPhotoOut:
    """Store a photo for an entry, without its metadata."""
    content = await request.body()
    return await to_thread.run_sync(_store_photo, services, access, inspection, content)


def _store_photo(
    services: Services, access: Access, inspection: UUID, content: bytes
) -> InspectionPhotoOut:
    with services.database.writing() as session:
        row = inspection_of(session, access.gym.id, inspection)
        check_quota(session, session.get_one(Gym, access.gym.id))
    return InspectionPhotoOut(photo=store_photo(services.store, row, content))


@router.get("/gyms/{gym}/inspections/{inspection}/photos/{photo}", response_class=InspectionPhoto)
def read_inspection_photo(
    inspection: UUID, photo: PhotoName, services: ServicesOf, access: InspectorMay
) -> InspectionPhoto:
    """Return a photo of an inspection."""
    with services.database.reading() as session:
        row = inspection_of(session, access.gym.id, inspection)
    headers = {"cache-control": "private, max-age=31536000, immutable"}
    return InspectionPhoto(read_photo(services.store, row, photo), headers=headers)
