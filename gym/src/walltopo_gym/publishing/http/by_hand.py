"""Endpoints that add routes to a wall without a scan."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Any
from uuid import UUID, uuid4

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from walltopo_gym.api.error_responses import FaultOut
from walltopo_gym.api.fields import Body, Day, Text
from walltopo_gym.api.services import Db
from walltopo_gym.errors import RequestError
from walltopo_gym.gyms.access import Access, GuestMay, PublisherMay
from walltopo_gym.publishing.by_hand import (
    MAX_ROUTES,
    FactError,
    HandRoute,
    add_routes,
    check_facts,
)
from walltopo_gym.publishing.http.routes import RouteOut, Short, Tags, route_out, routes_of
from walltopo_gym.publishing.lines import check_line
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.route_table import COLUMNS, read_routes
from walltopo_gym.publishing.service import grade_of
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["routes"])


class NewRoute(Body):
    """A route that has no scan yet, with a name or a colour.

    `id` is the sender's choice: a repeated request with it adds nothing. Without `set_on` it was
    set today.
    """

    id: UUID | None = None
    name: Short = ""
    colour: Text = Field("", max_length=40)
    grade_system_id: UUID | None = None
    grade: Short = ""
    setter: Short = ""
    tags: Tags = Field(default_factory=list)
    set_on: Day | None = None
    strip_on: Day | None = None
    line_id: UUID | None = None


class NewRoutes(Body):
    """One route, or many: all of them are added, or none."""

    routes: Annotated[list[NewRoute], Field(min_length=1, max_length=MAX_ROUTES)]


class RouteTable(Body):
    """A table of routes as text; with `really` false it is only checked.

    `id` is the sender's choice: a repeated request with it adds nothing. `without_wrong`: add the
    right lines although others have errors.
    """

    id: UUID
    csv: str = Field(max_length=1_000_000)
    really: bool = False
    without_wrong: bool = False


class TableRoute(BaseModel):
    """A right line of a table; `known`: the wall has a route with the same name, colour and
    grade."""

    line: int
    name: str
    colour: str
    grade: str
    setter: str
    tags: list[str]
    set_on: date
    strip_on: date | None
    known: bool


class RouteTableOut(BaseModel):
    """The content of a table, and how many of its routes are on the wall now."""

    routes: list[TableRoute]
    errors: list[FaultOut]
    columns: list[str]
    added: int


@router.get("/gyms/{gym}/walls/{wall}/routes")
def list_wall_routes(wall: UUID, session: Db, access: GuestMay) -> list[RouteOut]:
    """Return the current routes of a wall, whether it has a published scan or not."""
    return routes_of(session, wall_of(session, access.gym.id, wall))


@router.post("/gyms/{gym}/walls/{wall}/routes", status_code=201)
def make_routes(wall: UUID, body: NewRoutes, session: Db, access: PublisherMay) -> list[RouteOut]:
    """Add routes to a wall without a scan; a later scan can place them."""
    row = wall_of(session, access.gym.id, wall)
    today = access.gym.today()
    routes = [
        _check_route(session, access, row, route, today, number if len(body.routes) > 1 else 0)
        for number, route in enumerate(body.routes, 1)
    ]
    return _added_routes(session, access, row, routes)


@router.post("/gyms/{gym}/walls/{wall}/routes/import")
def import_routes(wall: UUID, body: RouteTable, session: Db, access: PublisherMay) -> RouteTableOut:
    """Check a table of routes, or add its routes: all of them, or none if a line has an error."""
    row = wall_of(session, access.gym.id, wall)
    lines, faults = read_routes(session, row, body.csv, body.id, access.gym.today())
    is_added = body.really and bool(lines) and (body.without_wrong or not faults)
    if is_added:
        _added_routes(session, access, row, [line.route for line in lines])
    shown = [
        TableRoute(line=line.line, known=line.known, **_visible_facts(line.route.facts))
        for line in lines
    ]
    return RouteTableOut(
        routes=shown,
        errors=[FaultOut.of(fault) for fault in faults],
        columns=list(COLUMNS),
        added=len(lines) if is_added else 0,
    )


def _visible_facts(facts: Any) -> dict[str, Any]:
    hidden = ("grade_system_id", "line_id")
    return {name: value for name, value in facts.items() if name not in hidden}


def _check_route(
    session: Session, access: Access, wall: Wall, given: NewRoute, today: date, number: int
) -> HandRoute:
    """Return a route to add.

    Parameters
    ----------
    number : its place in the request, for the error; 0: it is the only one.

    Raises
    ------
    RequestError : a fact is wrong.
    """
    facts = given.model_dump(exclude={"id"})
    facts["set_on"] = given.set_on or today
    wrong = check_facts(facts)
    try:
        facts["grade"] = grade_of(session, access.gym.id, given.grade_system_id, given.grade)
    except RequestError as error:
        wrong.append(FactError("grade", error))
    try:
        check_line(session, wall.id, facts)
    except RequestError as error:
        wrong.append(FactError("line", error))
    if wrong and not number:
        raise wrong[0].error
    if wrong:
        column, first = wrong[0]
        raise RequestError(
            "route-of-many",
            first.hint_key,
            number=number,
            column=column,
            why=first.message,
            **first.values,
        )
    return HandRoute(given.id or uuid4(), facts)


def _added_routes(
    session: Session, access: Access, wall: Wall, routes: list[HandRoute]
) -> list[RouteOut]:
    rows: list[Route] = add_routes(session, wall, routes)
    access.log_change(
        session,
        "route.add",
        subject=wall.name,
        wall=str(wall.id),
        routes=len(rows),
    )
    return [route_out(row) for row in rows]
