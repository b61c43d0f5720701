"""Endpoints of routes, current or stripped, and pictures of them."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_climb.description.sentences import Detail, Unit, Wording
from walltopo_climb.description.steps import StepKind
from walltopo_gym.api.fields import Body, Day, Name, Text
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import GuestMay, PublisherMay
from walltopo_gym.languages import Language
from walltopo_gym.publishing.description import describe_placed
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.service import (
    change_facts,
    strip_without_scan,
    touch_wall,
    undo_stripping,
)
from walltopo_gym.publishing.similar import similar_routes
from walltopo_gym.publishing.versions import gym_routes, route_of, shown_placement, wall_routes
from walltopo_gym.scans.pictures import route_picture, wall_picture
from walltopo_gym.walls.disciplines import Discipline
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["routes"])

Tags = Annotated[list[Name], Field(max_length=20)]
Short = Annotated[Text, Field(max_length=80)]


class RouteIn(Body):
    """A route's facts; a change keeps omitted ones."""

    name: Short | None = None
    grade_system_id: UUID | None = None
    grade: Short | None = None
    setter: Short | None = None
    tags: Tags | None = None
    set_on: Day | None = None
    strip_on: Day | None = None
    line_id: UUID | None = None

    def facts(self) -> dict[str, object]:
        """Return the given facts by column."""
        given = self.model_dump(exclude={"number", "route_id"}, exclude_unset=True)
        return {
            name: value
            for name, value in given.items()
            if value is not None or name in ("grade_system_id", "strip_on", "line_id")
        }


class RouteChange(RouteIn):
    """Changes of a route; a colour is what the setter says, whatever a scan found."""

    colour: Text | None = Field(None, max_length=40)


class LineOfRoute(BaseModel):
    """The line on which a route is climbed."""

    id: UUID
    label: str


class RouteOut(BaseModel):
    """A route; `number`, `holds` and style are those of the published version. `by_hand`: it was
    added without a scan; while its `number` is null, the 3D view does not show it. `disciplines`:
    in which it is climbed, the usual one first; `line` is null for a boulder. `reach`: heights
    in metres (1.20 to 1.95, in steps of .15) for which the movement model finds moves to the top;
    null while they are computed, or if the route is no climb. `longest_reach`: for each height of
    `reach`, the longest distance in metres between both hands at once. `height_m`: of the highest
    above the lowest hold."""

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
    by_hand: bool
    disciplines: list[Discipline]
    line: LineOfRoute | None
    number: int | None = None
    holds: list[int] = []
    steepness_deg: float | None = None
    hold_types: dict[str, int] = {}
    reach: list[float] | None = None
    longest_reach: list[float] | None = None
    height_m: float | None = None


@router.get("/gyms/{gym}/routes")
def list_routes(session: Db, access: GuestMay) -> list[RouteOut]:
    """Return the current routes of a gym, wall by wall."""
    return [route_out(route, placed) for route, placed in gym_routes(session, access.gym.id)]


@router.get("/gyms/{gym}/routes/{route}")
def read_route(route: UUID, session: Db, access: GuestMay) -> RouteOut:
    """Return a route, current or stripped."""
    return _current_route(session, route_of(session, access.gym.id, route))


class SimilarRoutes(BaseModel):
    """Current routes that climb like a given one, the most similar first."""

    routes: list[UUID]


@router.get("/gyms/{gym}/routes/{route}/similar")
def list_similar_routes(route: UUID, session: Db, access: GuestMay) -> SimilarRoutes:
    """Return the routes whose moves, holds and steepness are most like those of a route, current or
    stripped; none if the movement model finds no moves on it."""
    row = route_of(session, access.gym.id, route)
    return SimilarRoutes(routes=similar_routes(session, access.gym.id, row.id))


class SentenceOut(BaseModel):
    """A sentence about a step of a route; `hold`: its id in the version, 0 for none. `speech_s`:
    seconds of a calm voice."""

    kind: StepKind
    hold: int
    text: str
    speech_s: float


class DescriptionOut(BaseModel):
    """A route in words, for a body of `height_m`."""

    scan_id: UUID
    height_m: float
    sentences: list[SentenceOut]


@router.get("/gyms/{gym}/routes/{route}/description")
def describe_route(
    route: UUID,
    session: Db,
    services: ServicesOf,
    access: GuestMay,
    language: Language = "en",
    detail: Detail = "normal",
    unit: Unit = "centimetres",
    height_cm: Annotated[int | None, Query(ge=90, le=230)] = None,
) -> DescriptionOut:
    """Describe a current route in words, move by move, for climbers who hear it. The moves are the
    suggested ones of the body next to `height_cm`."""
    row = route_of(session, access.gym.id, route)
    words = Wording(language, detail, unit)
    found = describe_placed(session, services.store, access.gym.id, row, height_cm, words)
    return DescriptionOut(
        scan_id=found.scan,
        height_m=found.height,
        sentences=[
            SentenceOut(kind=one.step.kind, hold=one.step.hold, text=one.text, speech_s=one.speech)
            for one in found.sentences
        ],
    )


@router.patch("/gyms/{gym}/routes/{route}")
def change_route(route: UUID, body: RouteChange, session: Db, access: PublisherMay) -> RouteOut:
    """Change a route's facts."""
    row = route_of(session, access.gym.id, route)
    change_facts(session, access.gym.id, row, body.facts(), access.actor.known)
    return _current_route(session, row)


@router.post("/gyms/{gym}/routes/{route}/strip")
def strip_route(route: UUID, session: Db, access: PublisherMay) -> RouteOut:
    """Strip a route without a new scan."""
    row = route_of(session, access.gym.id, route)
    strip_without_scan(session, row)
    session.refresh(row)
    touch_wall(session, row.wall_id)
    access.log_change(session, "route.strip", str(row.id))
    return _current_route(session, row)


@router.post("/gyms/{gym}/routes/{route}/restore")
def restore_route(route: UUID, session: Db, access: PublisherMay) -> RouteOut:
    """Undo the stripping of a route without a new scan."""
    row = route_of(session, access.gym.id, route)
    undo_stripping(session, row)
    session.refresh(row)
    touch_wall(session, row.wall_id)
    access.log_change(session, "route.restore", str(row.id))
    return _current_route(session, row)


def routes_of(session: Session, wall: Wall) -> list[RouteOut]:
    """Return the current routes of a wall by number, those without a placement last."""
    return [route_out(route, placed) for route, placed in wall_routes(session, wall)]


def _current_route(session: Session, row: Route) -> RouteOut:
    wall = session.get_one(Wall, row.wall_id)
    placed = select(Placement).where(
        Placement.route_id == row.id, Placement.scan_id == wall.published_scan_id
    )
    return route_out(row, session.scalar(placed))


def route_out(row: Route, placement: Placement | None = None) -> RouteOut:
    """Return a route as the API has it."""
    facts = RouteOut.model_validate(row, from_attributes=True)
    if placement is not None:
        facts.number, facts.holds = placement.number, placement.holds
        facts.steepness_deg, facts.hold_types = placement.steepness_deg, placement.hold_types
        facts.reach, facts.longest_reach = placement.reach, placement.longest_reach
        facts.height_m = placement.height_m
    return facts


pictures_router = APIRouter(tags=["pictures"])


class Picture(Response):
    media_type = "image/jpeg"


@pictures_router.get("/gyms/{gym}/walls/{wall}/picture", response_class=Picture)
def read_wall_picture(wall: UUID, session: Db, services: ServicesOf, access: GuestMay) -> Picture:
    """Return a picture of the published version from the front."""
    scan = wall_of(session, access.gym.id, wall).published_scan_id
    if scan is None:
        raise NotFoundError("nothing-published")
    return Picture(
        wall_picture(services.store, scan), headers=_cache_headers(access.gym.visibility)
    )


@pictures_router.get("/gyms/{gym}/routes/{route}/picture", response_class=Picture)
def read_route_picture(route: UUID, session: Db, services: ServicesOf, access: GuestMay) -> Picture:
    """Return a picture of a route in the published version."""
    placed = shown_placement(session, access.gym.id, route)
    picture = route_picture(services.store, placed.scan_id, placed.holds)
    return Picture(picture, headers=_cache_headers(access.gym.visibility))


def _cache_headers(visibility: str) -> dict[str, str]:
    """Return headers for a day: given addresses name the version, which never changes."""
    return {"cache-control": f"{'private' if visibility == 'private' else 'public'}, max-age=86400"}
