"""Review and publication of a scan; routes and walls as everybody sees them."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Any, Literal
from uuid import UUID
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Header, Response
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.responses import StreamingResponse

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, Name, Text
from walltopo_gym.api.rules import Access, GuestMay, gym_rule
from walltopo_gym.api.scans import ScanFacts, facts_of, scan_of
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.walls import wall_of
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.change import Entry, check_grade, publish, put_back, strip
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.review import found_routes, review
from walltopo_gym.scans.states import State

__all__ = ["router"]

router = APIRouter(tags=["routes"])

PublisherMay = Annotated[Access, gym_rule(Role.SETTER, Scope.PUBLISH)]

Tags = Annotated[list[Name], Field(max_length=20)]


class RouteWords(Body):
    """What a setter says of a route; what is left out stays."""

    name: Text | None = None
    grade_system_id: UUID | None = None
    grade: Text | None = None
    setter: Text | None = None
    tags: Tags | None = None
    set_on: date | None = None
    strip_on: date | None = None

    def facts(self) -> dict[str, object]:
        """What was given, by column."""
        given = self.model_dump(exclude={"number", "route_id"}, exclude_unset=True)
        return {
            name: value for name, value in given.items()
            if value is not None or name in ("grade_system_id", "strip_on")
        }  # fmt: skip


class RouteEntry(RouteWords):
    """One route of the new scan: which one it is, or a new one."""

    number: int
    route_id: UUID | None = None


class Publication(Body):
    """The confirmed table; `revision` is the wall's, as it stood in the draft."""

    revision: int
    routes: list[RouteEntry] = Field(max_length=1000)


class PuttingBack(Body):
    scan_id: UUID
    revision: int


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
    """What a scan in review would change."""

    revision: int
    lines: list[DraftLine]


class RouteFacts(BaseModel):
    """A route; `number` and `holds` are those of the version that is published."""

    id: UUID
    wall_id: UUID
    name: str
    colour: str
    grade_system_id: UUID | None
    grade: str
    setter: str
    tags: list[str]
    set_on: date
    strip_on: date | None
    stripped_at: datetime | None
    number: int | None = None
    holds: list[int] = []


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
    if row.state != State.REVIEW:
        raise ConflictError(f"the scan is {row.state}, not in review")
    found = review(session, services.store, row)
    lines = [
        DraftLine(
            fate=line.fate.value, route_id=line.route, number=line.number,
            colour="" if line.number is None else found.routes[line.number].colour,
            came=list(line.came), went=list(line.went), moved=list(line.moved),
        )
        for line in found.lines
    ]  # fmt: skip
    return Draft(revision=found.revision, lines=lines)


@router.post("/gyms/{gym}/scans/{scan}/publish")
def publish_scan(
    scan: UUID, body: Publication, session: Db, services: ServicesOf, access: PublisherMay
) -> ScanFacts:
    """Let the scan be the wall, with these routes; all at once."""
    row = scan_of(session, access.gym.id, scan)
    if row.state != State.REVIEW:
        raise ConflictError(f"the scan is {row.state}, not in review")
    routes = found_routes(services.store, row.id)
    entries = []
    for given in body.routes:
        check_grade(session, access.gym.id, given.grade_system_id, given.grade or "")
        facts = given.facts()
        if given.route_id is None and given.number in routes:
            facts = {"colour": routes[given.number].colour} | facts
        entries.append(Entry(given.number, given.route_id, facts))
    holds = {number: route.holds for number, route in routes.items()}
    today = now().astimezone(ZoneInfo(access.gym.time_zone)).date()
    publish(session, row, body.revision, entries, holds, today)
    session.refresh(row)
    _log(session, access, "scan.publish", str(row.id))
    return facts_of(session, row)


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
        routes=_routes(session, row),
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
    headers = {
        "etag": f'"{known["key"].rpartition("/")[2]}"',
        "cache-control": f"{'public' if is_open else 'private'}, max-age=31536000, immutable",
        "content-length": str(known["size"]),
    }
    pieces = services.store.chunks(known["key"])
    return StreamingResponse(pieces, media_type=known["type"], headers=headers)


@router.get("/gyms/{gym}/routes/{route}")
def read_route(route: UUID, session: Db, access: GuestMay) -> RouteFacts:
    """A route, whether it hangs or not."""
    return _one(session, _route_of(session, access, route))


@router.patch("/gyms/{gym}/routes/{route}")
def change_route(route: UUID, body: RouteWords, session: Db, access: PublisherMay) -> RouteFacts:
    """Change what is said of a route."""
    row = _route_of(session, access, route)
    for name, value in body.facts().items():
        setattr(row, name, value)
    check_grade(session, access.gym.id, row.grade_system_id, row.grade)
    _touch(session, row)
    _log(session, access, "route.change", str(row.id))
    return _one(session, row)


@router.post("/gyms/{gym}/routes/{route}/strip")
def strip_route(route: UUID, session: Db, access: PublisherMay) -> RouteFacts:
    """Take a route off the wall without a new scan."""
    row = _route_of(session, access, route)
    strip(session, row)
    session.refresh(row)
    _touch(session, row)
    _log(session, access, "route.strip", str(row.id))
    return _one(session, row)


def _routes(session: Session, wall: Wall) -> list[RouteFacts]:
    rows = session.execute(
        select(Route, Placement)
        .join(Placement, Placement.route_id == Route.id)
        .where(Placement.scan_id == wall.published_scan_id, Route.stripped_at.is_(None))
        .order_by(Placement.number)
    )
    return [_told(route, placement) for route, placement in rows]


def _route_of(session: Session, access: Access, route: UUID) -> Route:
    found = select(Route).join(Wall, Wall.id == Route.wall_id)
    row = session.scalar(found.where(Route.id == route, Wall.gym_id == access.gym.id))
    if row is None:
        raise NotFoundError("no such route")
    return row


def _one(session: Session, row: Route) -> RouteFacts:
    wall = session.get_one(Wall, row.wall_id)
    placed = select(Placement).where(
        Placement.route_id == row.id, Placement.scan_id == wall.published_scan_id
    )
    return _told(row, session.scalar(placed))


def _told(row: Route, placement: Placement | None) -> RouteFacts:
    facts = RouteFacts.model_validate(row, from_attributes=True)
    if placement is not None:
        facts.number, facts.holds = placement.number, placement.holds
    return facts


def _touch(session: Session, row: Route) -> None:
    """The wall reads otherwise now: its tag changes, and who confirms an older draft is told."""
    wall = session.get_one(Wall, row.wall_id, with_for_update=True)
    wall.revision += 1


def _log(session: Session, access: Access, action: str, subject: str) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id, subject=subject)
