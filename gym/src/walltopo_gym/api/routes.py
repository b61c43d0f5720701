"""Routes, whether they hang or not."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, Name, Text
from walltopo_gym.api.rules import Access, GuestMay, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.change import check_grade, strip
from walltopo_gym.publishing.hanging import gym_routes, wall_routes
from walltopo_gym.publishing.models import Placement, Route

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


class RouteFacts(BaseModel):
    """A route; `number`, `holds` and its style are those of the version that is published."""

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
    steepness_deg: float | None = None
    hold_types: dict[str, int] = {}


@router.get("/gyms/{gym}/routes")
def list_routes(session: Db, access: GuestMay) -> list[RouteFacts]:
    """What hangs in the gym, wall by wall."""
    return [_told(route, placement) for route, placement in gym_routes(session, access.gym.id)]


@router.get("/gyms/{gym}/routes/{route}")
def read_route(route: UUID, session: Db, access: GuestMay) -> RouteFacts:
    """A route, whether it hangs or not."""
    return _one(session, route_of(session, access, route))


@router.patch("/gyms/{gym}/routes/{route}")
def change_route(route: UUID, body: RouteWords, session: Db, access: PublisherMay) -> RouteFacts:
    """Change what is said of a route."""
    row = route_of(session, access, route)
    for name, value in body.facts().items():
        setattr(row, name, value)
    check_grade(session, access.gym.id, row.grade_system_id, row.grade)
    _touch(session, row)
    _log(session, access, "route.change", str(row.id))
    return _one(session, row)


@router.post("/gyms/{gym}/routes/{route}/strip")
def strip_route(route: UUID, session: Db, access: PublisherMay) -> RouteFacts:
    """Take a route off the wall without a new scan."""
    row = route_of(session, access, route)
    strip(session, row)
    session.refresh(row)
    _touch(session, row)
    _log(session, access, "route.strip", str(row.id))
    return _one(session, row)


def routes_of(session: Session, wall: Wall) -> list[RouteFacts]:
    """The routes that hang on a wall, by their numbers."""
    return [_told(route, placement) for route, placement in wall_routes(session, wall)]


def route_of(session: Session, access: Access, route: UUID) -> Route:
    """A route of this gym.

    Raises
    ------
    NotFoundError : there is none, or it is another gym's.
    """
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
        facts.steepness_deg, facts.hold_types = placement.steepness_deg, placement.hold_types
    return facts


def _touch(session: Session, row: Route) -> None:
    """The wall reads otherwise now: its tag changes, and who confirms an older draft is told."""
    wall = session.get_one(Wall, row.wall_id, with_for_update=True)
    wall.revision += 1


def _log(session: Session, access: Access, action: str, subject: str) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id, subject=subject)
