"""Endpoints of scans: create, start, watch, cancel."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Annotated, Self
from uuid import UUID

from anyio import sleep, to_thread
from fastapi import APIRouter, Depends, Request, Response
from fastapi.sse import EventSourceResponse
from pydantic import AfterValidator, Field, model_validator
from sqlalchemy import select

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.fields import Body, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.gyms.access import Access, PublisherMay, gym_rule
from walltopo_gym.gyms.roles import Role
from walltopo_gym.scans.amendments import amend
from walltopo_gym.scans.first_looks import read_first_look
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.scan_out import ScanOut, scan_out
from walltopo_gym.scans.service import State, change_state, create_version, request_run, scan_of
from walltopo_gym.walls.lookup import wall_of

router = APIRouter(tags=["scans"])

UploaderMay = Annotated[Access, gym_rule(Role.SETTER, Scope.UPLOAD)]

_WATCH_S = 0.5


def _in_a_list(colour: str) -> str:
    """Return a colour that can be one of several, separated by commas."""
    if not colour or "," in colour:
        raise ValueError("expected a colour's name without commas")
    return colour


HoldColour = Annotated[Text, Field(max_length=40), AfterValidator(_in_a_list)]


class ScanStart(Body):
    """`part`: the photos show a part of the wall. The rest is taken from the published version.
    `colours`: only holds of these colours are exchanged there; empty: all."""

    part: bool = False
    colours: list[HoldColour] = Field(default=[], max_length=20)

    @model_validator(mode="after")
    def _colours_of_a_part(self) -> Self:
        if self.colours and not self.part:
            raise ValueError("colours need part")
        return self


@router.get("/gyms/{gym}/walls/{wall}/scans")
def list_scans(
    wall: UUID, session: Db, access: UploaderMay, cursor: Cursor = None, size: Size = 50
) -> Page[ScanOut]:
    """Return the wall's versions, the newest first."""
    wall_of(session, access.gym.id, wall)
    rows, following = page_of(session, select(Scan).where(Scan.wall_id == wall), Scan, cursor, size)
    return Page(items=[scan_out(session, row) for row in rows], next=following)


@router.post("/gyms/{gym}/walls/{wall}/scans", status_code=201)
def begin_scan(wall: UUID, session: Db, access: UploaderMay) -> ScanOut:
    """Create a version of the wall for uploads. It gets the coordinate frame of the published
    version."""
    row = wall_of(session, access.gym.id, wall)
    scan = create_version(session, row, access.actor.known)
    access.log_change(session, "scan.create", str(scan.id))
    return scan_out(session, scan)


@router.post("/gyms/{gym}/walls/{wall}/amendments", status_code=201)
def amend_wall(wall: UUID, services: ServicesOf, access: PublisherMay) -> ScanOut:
    """Create an amendment of the published version: the same mesh and photos, to be edited,
    reviewed and published. An amendment that is in review already is returned."""
    with services.database.reading() as session:
        row = wall_of(session, access.gym.id, wall)
    scan = amend(services.database, services.store, row.id, access.actor.known)
    with services.database.reading() as session:
        return scan_out(session, session.get_one(Scan, scan))


@router.get("/gyms/{gym}/scans/{scan}")
def read_scan(scan: UUID, session: Db, access: UploaderMay) -> ScanOut:
    """Return a version of a wall and its progress."""
    return scan_out(session, scan_of(session, access.gym.id, scan))


@router.get(
    "/gyms/{gym}/scans/{scan}/first-look",
    response_class=Response,
    responses={200: {"content": {"model/gltf-binary": {}}}, 204: {"description": "no look yet"}},
)
def read_scan_look(
    scan: UUID, request: Request, session: Db, services: ServicesOf, access: UploaderMay
) -> Response:
    """Return the wall as a running scan knows it, as GLB without holds; 204 before the first look.
    It changes while the scan runs."""
    found = read_first_look(services.store, scan_of(session, access.gym.id, scan).id)
    if found is None:
        return Response(status_code=204)
    content, version = found
    headers = {"etag": f'"{version}"', "cache-control": "private, no-cache"}
    if request.headers.get("if-none-match") == headers["etag"]:
        return Response(status_code=304, headers=headers)
    return Response(content, media_type="model/gltf-binary", headers=headers)


@dataclass(frozen=True)
class _Watched:
    """A scan whose progress a client streams, and its state when the stream began."""

    gym: UUID
    facts: ScanOut


def _to_watch(scan: UUID, session: Db, access: UploaderMay) -> _Watched:
    """Look the scan up before the response begins, because a stream cannot answer 404."""
    facts = scan_out(session, scan_of(session, access.gym.id, scan))
    return _Watched(access.gym.id, facts)


def _scan_now(services: Services, watched: _Watched) -> ScanOut:
    with services.database.reading() as session:
        return scan_out(session, scan_of(session, watched.gym, watched.facts.id))


@router.get("/gyms/{gym}/scans/{scan}/events", response_class=EventSourceResponse)
async def watch_scan(
    request: Request, services: ServicesOf, first: Annotated[_Watched, Depends(_to_watch)]
) -> AsyncIterator[ScanOut]:
    """Stream the progress of a scan until no worker works on it.

    It is read from the table, so that any server can stream the progress of any worker.
    """
    facts = first.facts
    yield facts
    while facts.state in (State.QUEUED, State.RUNNING) and not await request.is_disconnected():
        await sleep(_WATCH_S)
        before, facts = facts, await to_thread.run_sync(_scan_now, services, first)
        if facts != before:
            yield facts


@router.post("/gyms/{gym}/scans/{scan}/start")
def start_scan(
    scan: UUID, session: Db, access: UploaderMay, body: ScanStart | None = None
) -> ScanOut:
    """Start a scan of the photos, also after a failure or a cancellation."""
    row = scan_of(session, access.gym.id, scan)
    body = body or ScanStart()
    request_run(session, row, part=body.part, colours=body.colours)
    access.log_change(session, "scan.start", str(row.id))
    return scan_out(session, row)


@router.post("/gyms/{gym}/scans/{scan}/cancel")
def cancel_scan(scan: UUID, session: Db, access: UploaderMay) -> ScanOut:
    """Cancel a scan; finished stages are kept for a restart."""
    row = scan_of(session, access.gym.id, scan)
    change_state(session, row.id, State.CANCELLED)
    session.refresh(row)
    access.log_change(session, "scan.cancel", str(row.id))
    return scan_out(session, row)
