"""Endpoints of review, publication, planned publications and former versions."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from fastapi import APIRouter, Header, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.responses import StreamingResponse

from walltopo.scans import joined as joined_in
from walltopo.scans import routes as found_in
from walltopo_gym.api.fields import Body, Moment, Revision
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.access import Access, GuestMay, PublisherMay
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.http.routes import RouteIn, RouteOut, route_out, routes_of
from walltopo_gym.publishing.lines import check_line
from walltopo_gym.publishing.models import Plan
from walltopo_gym.publishing.plans import check_unplanned, rows_of
from walltopo_gym.publishing.review import found_routes, review
from walltopo_gym.publishing.service import (
    Entry,
    Placed,
    check_entries,
    grade_of,
    publish,
    roll_back,
)
from walltopo_gym.publishing.versions import routes_as_they_were, unplaced_routes, versions_of
from walltopo_gym.scans.distance import check_scalable, mark_points, set_distance
from walltopo_gym.scans.edits import check_carried_out, results_version
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.scan_out import ScanOut, scan_out
from walltopo_gym.scans.service import State, change_state, check_in_review, scan_of
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import Wall
from walltopo_gym.walls.zones import queue_publications

router = APIRouter(tags=["publishing"])

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Place = tuple[Coordinate, Coordinate, Coordinate]


class RouteEntry(RouteIn):
    """A route of the new scan: an existing route, or a new one."""

    number: int
    route_id: UUID | None = None


class Publication(Body):
    """The confirmed table; `revision` is the wall's, as the draft had it."""

    revision: Revision
    routes: list[RouteEntry] = Field(max_length=1000)


class PuttingBack(Body):
    scan_id: UUID
    revision: Revision


class DraftLine(BaseModel):
    """One line of the table to confirm. `line_id`: the line that a new route probably hangs on, by
    its holds. `photographed`: a partial rescan exchanged or confirmed a
    hold of the route; always true for a scan of the whole wall."""

    fate: Literal["kept", "changed", "new", "stripped"]
    route_id: UUID | None
    number: int | None
    line_id: UUID | None
    colour: str
    came: list[int]
    went: list[int]
    moved: list[int]
    photographed: bool


class Joined(BaseModel):
    """The parts of a wall that a partial rescan replaced: the share of the surface, the distance of
    old and new surface along the seam in millimetres (null if they nowhere meet), the lines of the
    seam in the scan's frame, and counts of holds: not photographed, photographed and unchanged,
    gone, and new. `colours`: only holds of these colours were exchanged (empty: all); then
    `missing` are the ids of holds of other colours that stay, although the photos do not show them,
    and `ignored` counts new holds that were not added."""

    replaced_share: float
    seam_mm: float | None
    seam: list[list[Place]]
    stays: int
    same: int
    gone: int
    added: int
    colours: list[str]
    missing: list[int]
    ignored: int

    @classmethod
    def of(cls, joined: joined_in.Joined | None) -> Joined | None:
        """Return the facts that the draft shows, None for a scan of the whole wall."""
        if joined is None:
            return None
        return cls(
            replaced_share=joined.replaced_share,
            seam_mm=joined.seam_mm,
            seam=[list(line) for line in joined.seam],
            stays=len(joined.stays),
            same=len(joined.same),
            gone=len(joined.gone),
            added=len(joined.added),
            colours=list(joined.colours),
            missing=list(joined.missing),
            ignored=joined.ignored,
        )


class Draft(BaseModel):
    """The changes that publishing a scan would make; `warnings`: regressions since the last
    version. `unplaced`: routes that were added by hand; an entry may name one of them, and then
    this scan places it."""

    revision: int
    warnings: list[str]
    lines: list[DraftLine]
    unplaced: list[RouteOut]
    joined: Joined | None


class MovesOut(BaseModel):
    """Suggested moves of a version, computed after its publication.

    `routes`: numbers of the routes with moves in the version's file `moves.json`. "failed": they
    could not be computed.
    """

    state: Literal["waiting", "ready", "failed"]
    routes: list[int]

    @classmethod
    def of(cls, scan: Scan) -> MovesOut:
        """Return those of a published scan."""
        if scan.moves is None:
            return cls(state="waiting", routes=[])
        state: Literal["ready", "failed"] = "failed" if scan.moves["error"] else "ready"
        return cls(state=state, routes=scan.moves["routes"])


class Version(BaseModel):
    """The public version of a wall; `files`: path in the page to address."""

    scan_id: UUID
    revision: int
    published_at: datetime
    files: dict[str, str]
    moves: MovesOut
    routes: list[RouteOut]


@router.get("/gyms/{gym}/scans/{scan}/draft")
def read_draft(scan: UUID, session: Db, services: ServicesOf, access: PublisherMay) -> Draft:
    """Return which routes publishing the scan would keep, add and strip."""
    row = scan_of(session, access.gym.id, scan)
    check_in_review(row.state)
    found = review(session, services.store, row)
    apart = frozenset(() if found.joined is None else found.joined.stays)

    def is_photographed(number: int | None) -> bool:
        return number is None or not apart.issuperset(found.routes[number].holds)

    lines = [
        DraftLine(
            fate=line.status.value,
            route_id=line.route,
            number=line.number,
            line_id=None if line.number is None else found.ropes.get(line.number),
            colour="" if line.number is None else found.routes[line.number].colour,
            came=list(line.added),
            went=list(line.removed),
            moved=list(line.moved),
            photographed=is_photographed(line.number),
        )
        for line in found.lines
    ]
    unplaced = unplaced_routes(session, session.get_one(Wall, row.wall_id))
    return Draft(
        revision=found.revision,
        warnings=found.warnings,
        lines=lines,
        unplaced=[route_out(route) for route in unplaced],
        joined=Joined.of(found.joined),
    )


@router.post("/gyms/{gym}/scans/{scan}/publish")
def publish_scan(
    scan: UUID, body: Publication, services: ServicesOf, access: PublisherMay
) -> ScanOut:
    """Publish a scan with these routes, in one transaction."""
    results = _read_results(services, access, scan)
    with services.database.writing() as session:
        row = scan_of(session, access.gym.id, scan)
        entries, found = confirmed_table(session, access, row, body, results)
        publish(session, row, body.revision, entries, found, access.gym.today())
        session.refresh(row)
        access.log_change(session, "scan.publish", str(row.id))
        return scan_out(session, row)


@router.post("/gyms/{gym}/scans/{scan}/discard")
def discard_scan(scan: UUID, session: Db, access: PublisherMay) -> ScanOut:
    """Discard a scan in review. Its files are kept; a scan of photos can be started again."""
    row = scan_of(session, access.gym.id, scan)
    check_in_review(row.state)
    check_unplanned(session, row.id)
    change_state(session, row.id, State.CANCELLED, before=State.REVIEW)
    session.refresh(row)
    access.log_change(session, "scan.discard", str(row.id))
    return scan_out(session, row)


class KnownDistance(Body):
    """Two points of the wall in the scan's own frame, and their distance in metres."""

    points: tuple[Place, Place]
    metres: Annotated[float, Field(ge=0.05, le=200)]


@router.post("/gyms/{gym}/scans/{scan}/distance")
def scale_scan(
    scan: UUID, body: KnownDistance, services: ServicesOf, access: PublisherMay
) -> ScanOut:
    """Scale a scan in review by a known distance: it runs again from the stage `scale` on. The
    edits of the scan are dropped. A version of a published wall has the scale of that version."""
    with services.database.reading() as session:
        row = scan_of(session, access.gym.id, scan)
        check_scalable(row)
    marked = mark_points(services.store, scan, body.points)
    with services.database.writing() as session:
        row = scan_of(session, access.gym.id, scan)
        check_unplanned(session, row.id)
        check_carried_out(session, row.id)  # or its results would come after those of the new run
        set_distance(session, row, marked, body.metres)
        access.log_change(session, "scan.scale", str(row.id))
        return scan_out(session, row)


@dataclass(frozen=True)
class _Results:
    """The routes of a scan in review by number, and of which of its results they are."""

    routes: dict[int, found_in.Route]
    version: tuple[int, int]


def _read_results(services: Services, access: Access, scan: UUID) -> _Results:
    """Read the routes of a scan outside of a write transaction.

    Raises
    ------
    ConflictError : the scan is not in review.
    """
    with services.database.reading() as session:
        row = scan_of(session, access.gym.id, scan)
        check_in_review(row.state)
        version = results_version(session, row)
    return _Results(found_routes(services.store, scan), version)


def confirmed_table(
    session: Session, access: Access, scan: Scan, body: Publication, results: _Results
) -> tuple[list[Entry], dict[int, Placed]]:
    """Return a setter's checked table, and the scan's routes by number.

    Raises
    ------
    ConflictError : the scan is not in review, its last edits are not applied yet, or it has other
        results now.
    RequestError : a grade is not the gym's, or a line is not the wall's.
    """
    check_in_review(scan.state)
    check_carried_out(session, scan.id)
    if results_version(session, scan) != results.version:
        raise ConflictError("wall-changed", "look-at-it-again")
    routes = results.routes
    entries = []
    for given in body.routes:
        grade = grade_of(session, access.gym.id, given.grade_system_id, given.grade or "")
        facts = given.facts()
        check_line(session, scan.wall_id, facts)
        if "grade" in facts:
            facts["grade"] = grade
        if given.route_id is None and given.number in routes:
            facts = {"colour": routes[given.number].colour} | facts
        entries.append(Entry(given.number, given.route_id, facts))
    return entries, {number: Placed.of(route) for number, route in routes.items()}


@router.post("/gyms/{gym}/walls/{wall}/put-back")
def put_back_scan(wall: UUID, body: PuttingBack, session: Db, access: PublisherMay) -> ScanOut:
    """Roll back to a former version."""
    row = scan_of(session, access.gym.id, body.scan_id)
    if row.wall_id != wall_of(session, access.gym.id, wall).id:
        raise NotFoundError("not-there-version")
    roll_back(session, row, body.revision)
    session.refresh(row)
    access.log_change(session, "scan.put-back", str(row.id))
    return scan_out(session, row)


@router.get("/gyms/{gym}/walls/{wall}/published", response_model=Version)
def read_published(
    wall: UUID,
    session: Db,
    access: GuestMay,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """Return files and routes of the published version, and the routes that were added by hand."""
    row = wall_of(session, access.gym.id, wall)
    if row.published_scan_id is None:
        raise NotFoundError("nothing-published")
    scan = scan_of(session, access.gym.id, row.published_scan_id)
    base = f"/api/v1/gyms/{access.gym.slug}/scans/{scan.id}/files"
    assert scan.published_at is not None
    version = Version(
        scan_id=scan.id,
        revision=row.revision,
        published_at=scan.published_at,
        files={path: f"{base}/{path}" for path in sorted(scan.files)},
        moves=MovesOut.of(scan),
        routes=routes_of(session, row),
    )
    # The tag is of the content: grades and setters change without the wall's revision.
    content = version.model_dump_json().encode()
    headers = {"etag": f'"{hashlib.sha256(content).hexdigest()[:32]}"'}
    if if_none_match == headers["etag"]:
        return Response(status_code=304, headers=headers)
    return Response(content, media_type="application/json", headers=headers)


@router.get("/gyms/{gym}/scans/{scan}/files/{path:path}", response_class=StreamingResponse)
def read_file(
    scan: UUID, path: str, session: Db, services: ServicesOf, access: GuestMay
) -> StreamingResponse:
    """Return a file of a version; before its publication only to setters."""
    row = scan_of(session, access.gym.id, scan)
    is_public = row.state in (State.PUBLISHED, State.SUPERSEDED)
    known: dict[str, Any] | None = row.files.get(path)
    if known is None or not (is_public or access.role.covers(Role.SETTER)):
        raise NotFoundError("not-there-file")
    is_open = is_public and access.gym.visibility != "private"
    # A scan in review may still be corrected, under the same address.
    caching = f"{'public' if is_open else 'private'}, max-age=31536000, immutable"
    headers = {
        "etag": f'"{known["key"].rpartition("/")[2]}"',
        "cache-control": caching if is_public else "private, no-cache",
        "content-length": str(known["size"]),
    }
    pieces = services.store.chunks(known["key"])
    return StreamingResponse(pieces, media_type=known["type"], headers=headers)


class PastVersion(BaseModel):
    """A version that was published once; `published_at`: since when."""

    scan_id: UUID
    published_at: datetime
    present: bool


@router.get("/gyms/{gym}/walls/{wall}/past")
def list_past(
    wall: UUID,
    session: Db,
    access: GuestMay,
    route: Annotated[UUID | None, Query(description="only versions in which it hangs")] = None,
) -> list[PastVersion]:
    """Return the public versions of a wall, the earliest first."""
    row = wall_of(session, access.gym.id, wall)
    return [
        PastVersion(
            scan_id=scan.id, published_at=scan.published_at, present=scan.state == State.PUBLISHED
        )
        for scan in versions_of(session, row.id, route)
        if scan.published_at is not None
    ]


@router.get("/gyms/{gym}/walls/{wall}/past/{scan}")
def read_past(wall: UUID, scan: UUID, session: Db, access: GuestMay) -> Version:
    """Return a former version: its files, and its routes as they were on its last day."""
    row = scan_of(session, access.gym.id, scan)
    found = wall_of(session, access.gym.id, wall)
    is_public = row.state in (State.PUBLISHED, State.SUPERSEDED)
    if row.wall_id != found.id or not is_public or row.published_at is None:
        raise NotFoundError("not-there-version")
    base = f"/api/v1/gyms/{access.gym.slug}/scans/{row.id}/files"
    routes = []
    for placement, route, then in routes_as_they_were(session, row.id):
        facts = RouteOut.model_validate(route, from_attributes=True).model_copy(update=then)
        facts.number, facts.holds = placement.number, placement.holds
        routes.append(facts)
    return Version(
        scan_id=row.id,
        revision=found.revision,
        published_at=row.published_at,
        files={path: f"{base}/{path}" for path in sorted(row.files)},
        moves=MovesOut.of(row),
        routes=routes,
    )


class NewPlan(Publication):
    """A confirmed table and its time: `at`, or with the whole zone (null)."""

    at: Moment | None = None


class PlanOut(BaseModel):
    """A planned publication; `error`: why it failed."""

    scan_id: UUID
    wall_id: UUID
    at: datetime | None
    created_at: datetime
    error: str


@router.get("/gyms/{gym}/plans")
def list_plans(session: Db, access: PublisherMay) -> list[PlanOut]:
    """Return the planned publications."""
    rows = session.execute(
        select(Plan, Scan.wall_id)
        .join(Scan, Scan.id == Plan.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == access.gym.id)
        .order_by(Plan.created_at)
    )
    return [_plan_out(plan, wall) for plan, wall in rows]


@router.put("/gyms/{gym}/scans/{scan}/plan")
def put_plan(scan: UUID, body: NewPlan, services: ServicesOf, access: PublisherMay) -> PlanOut:
    """Plan the publication of a scan with these routes, replacing an earlier plan."""
    results = _read_results(services, access, scan)
    with services.database.writing() as session:
        return _store_plan(session, access, scan, body, results)


def _store_plan(
    session: Session, access: Access, scan: UUID, body: NewPlan, results: _Results
) -> PlanOut:
    row = scan_of(session, access.gym.id, scan)
    entries, found = confirmed_table(session, access, row, body, results)
    wall = session.get_one(Wall, row.wall_id)
    if wall.revision != body.revision:
        raise ConflictError("wall-changed", "look-at-it-again")
    check_entries(session, row, entries, found)
    if body.at is None and not wall.zone:
        raise ConflictError("zone-none", "zone-give")
    plan = session.merge(
        Plan(
            scan_id=scan,
            over_id=wall.published_scan_id,
            made_by=access.actor.known,
            at=body.at,
            entries=rows_of(entries),
            found={str(n): each.row for n, each in found.items()},
            error="",
        )
    )
    queue_publications(session, access.gym.id, body.at)
    access.log_change(
        session,
        "scan.plan",
        subject=str(scan),
        at=None if body.at is None else body.at.isoformat(),
    )
    return _plan_out(plan, row.wall_id)


@router.delete("/gyms/{gym}/scans/{scan}/plan", status_code=204)
def drop_plan(scan: UUID, session: Db, access: PublisherMay) -> None:
    """Cancel a planned publication."""
    plan = session.get(Plan, scan_of(session, access.gym.id, scan).id)
    if plan is None:
        raise NotFoundError("plan-none")
    session.delete(plan)
    access.log_change(session, "scan.unplan", subject=str(scan))


def _plan_out(plan: Plan, wall: UUID) -> PlanOut:
    return PlanOut(
        scan_id=plan.scan_id, wall_id=wall, at=plan.at, created_at=plan.created_at, error=plan.error
    )
