"""Review and publication of a scan; routes and walls as everybody sees them."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal
from uuid import UUID
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Header, Response
from pydantic import BaseModel, Field
from sqlalchemy.orm import Session
from starlette.responses import StreamingResponse

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, Revision
from walltopo_gym.api.routes import PublisherMay, RouteFacts, RouteWords, routes_of
from walltopo_gym.api.rules import Access, GuestMay
from walltopo_gym.api.scans import ScanFacts, facts_of, scan_of
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.walls import wall_of
from walltopo_gym.clock import now
from walltopo_gym.editing.log import check_carried_out
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.change import Entry, Placed, check_grade, publish, put_back
from walltopo_gym.publishing.review import found_routes, review
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import State, check_in_review
from walltopo_gym.storage.files import FileStore

router = APIRouter(tags=["publishing"])


class RouteEntry(RouteWords):
    """One route of the new scan: which one it is, or a new one."""

    number: int
    route_id: UUID | None = None


class Publication(Body):
    """The confirmed table; `revision` is the wall's, as it stood in the draft."""

    revision: Revision
    routes: list[RouteEntry] = Field(max_length=1000)


class PuttingBack(Body):
    scan_id: UUID
    revision: Revision


class DraftLine(BaseModel):
    """One line of the table to confirm."""

    fate: Literal["kept", "changed", "new", "stripped"]
    route_id: UUID | None
    number: int | None
    colour: str
    came: list[int]
    went: list[int]
    moved: list[int]


class Draft(BaseModel):
    """What a scan in review would change; `warnings`: where it looks worse than the last one."""

    revision: int
    warnings: list[str]
    lines: list[DraftLine]


class Version(BaseModel):
    """What the public sees of a wall; `files` by their path in the page, with their addresses."""

    scan_id: UUID
    revision: int
    published_at: datetime
    files: dict[str, str]
    routes: list[RouteFacts]


@router.get("/gyms/{gym}/scans/{scan}/draft")
def read_draft(scan: UUID, session: Db, services: ServicesOf, access: PublisherMay) -> Draft:
    """What publishing the scan would change: which route is which."""
    row = scan_of(session, access.gym.id, scan)
    check_in_review(row.state)
    found = review(session, services.store, row)
    lines = [
        DraftLine(
            fate=line.fate.value, route_id=line.route, number=line.number,
            colour="" if line.number is None else found.routes[line.number].colour,
            came=list(line.came), went=list(line.went), moved=list(line.moved),
        )
        for line in found.lines
    ]  # fmt: skip
    return Draft(revision=found.revision, warnings=found.warnings, lines=lines)


@router.post("/gyms/{gym}/scans/{scan}/publish")
def publish_scan(
    scan: UUID, body: Publication, session: Db, services: ServicesOf, access: PublisherMay
) -> ScanFacts:
    """Let the scan be the wall, with these routes; all at once."""
    row = scan_of(session, access.gym.id, scan)
    entries, found = confirmed(session, services.store, access, row, body)
    today = now().astimezone(ZoneInfo(access.gym.time_zone)).date()
    publish(session, row, body.revision, entries, found, today)
    session.refresh(row)
    _log(session, access, "scan.publish", str(row.id))
    return facts_of(session, row)


def confirmed(
    session: Session, store: FileStore, access: Access, scan: Scan, body: Publication
) -> tuple[list[Entry], dict[int, Placed]]:
    """What a setter confirmed, checked; and the scan's routes by number.

    Raises
    ------
    ConflictError : the scan is not in review, or its last edits are not carried out yet.
    InputError : a grade is none of the gym's.
    """
    check_in_review(scan.state)
    check_carried_out(session, scan.id)
    routes = found_routes(store, scan.id)
    entries = []
    for given in body.routes:
        check_grade(session, access.gym.id, given.grade_system_id, given.grade or "")
        facts = given.facts()
        if given.route_id is None and given.number in routes:
            facts = {"colour": routes[given.number].colour} | facts
        entries.append(Entry(given.number, given.route_id, facts))
    return entries, {number: Placed.of(route) for number, route in routes.items()}


@router.post("/gyms/{gym}/walls/{wall}/put-back")
def put_back_scan(wall: UUID, body: PuttingBack, session: Db, access: PublisherMay) -> ScanFacts:
    """Let a former version be the wall again."""
    row = scan_of(session, access.gym.id, body.scan_id)
    if row.wall_id != wall_of(session, access.gym.id, wall).id:
        raise NotFoundError("no such version of this wall")
    put_back(session, row, body.revision)
    session.refresh(row)
    _log(session, access, "scan.put-back", str(row.id))
    return facts_of(session, row)


@router.get("/gyms/{gym}/walls/{wall}/published", response_model=Version)
def read_published(
    wall: UUID, response: Response, session: Db, access: GuestMay,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Version | Response:  # fmt: skip
    """What hangs: files and routes of the published version."""
    row = wall_of(session, access.gym.id, wall)
    if row.published_scan_id is None:
        raise NotFoundError("nothing of this wall is published yet")
    etag = f'"{row.id.hex}-{row.revision}"'
    if if_none_match == etag:
        return Response(status_code=304, headers={"etag": etag})
    scan = scan_of(session, access.gym.id, row.published_scan_id)
    response.headers["etag"] = etag
    base = f"/api/v1/gyms/{access.gym.slug}/scans/{scan.id}/files"
    assert scan.published_at is not None
    return Version(
        scan_id=scan.id,
        revision=row.revision,
        published_at=scan.published_at,
        files={path: f"{base}/{path}" for path in sorted(scan.files)},
        routes=routes_of(session, row),
    )


@router.get("/gyms/{gym}/scans/{scan}/files/{path:path}", response_class=StreamingResponse)
def read_file(
    scan: UUID, path: str, session: Db, services: ServicesOf, access: GuestMay
) -> StreamingResponse:
    """A file of a version; of one that was never published for setters alone."""
    row = scan_of(session, access.gym.id, scan)
    is_public = row.state in (State.PUBLISHED, State.SUPERSEDED)
    known: dict[str, Any] | None = row.files.get(path)
    if known is None or not (is_public or access.role.covers(Role.SETTER)):
        raise NotFoundError("no such file")
    is_open = is_public and access.gym.visibility != "private"
    # What is in review may still be corrected, under the same address.
    caching = f"{'public' if is_open else 'private'}, max-age=31536000, immutable"
    headers = {
        "etag": f'"{known["key"].rpartition("/")[2]}"',
        "cache-control": caching if is_public else "private, no-cache",
        "content-length": str(known["size"]),
    }
    pieces = services.store.chunks(known["key"])
    return StreamingResponse(pieces, media_type=known["type"], headers=headers)


def _log(session: Session, access: Access, action: str, subject: str) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id, subject=subject)
