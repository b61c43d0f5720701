"""How often routes were climbed, and what climbers think of them; nobody is named."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.api.routes import route_of
from walltopo_gym.api.rules import Access, GuestMay
from walltopo_gym.api.services import Db
from walltopo_gym.api.walls import wall_of
from walltopo_gym.climbing.models import Opinion
from walltopo_gym.climbing.tallies import tallies
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.hanging import gym_routes, wall_routes
from walltopo_gym.publishing.models import Placement
from walltopo_gym.scans.models import Scan

router = APIRouter(tags=["climbing"])


class TallyFacts(BaseModel):
    """What climbers did on a route and think of it.

    `crowd` is the median of the grade `votes`, empty while they are too few. Who has not voted
    does not see how the votes spread (`grades` is empty), so that each says what they felt;
    setters always do.
    """

    route_id: UUID
    ascents: dict[str, int]
    climbers: int
    stars: float | None
    crowd: str
    votes: int
    grades: dict[str, int]
    wishes: dict[str, int]


class Past(BaseModel):
    """A version of the wall in which the route hung; its number and holds there."""

    scan_id: UUID
    published_at: datetime
    number: int
    holds: list[int]


class Story(BaseModel):
    """What is told of a route besides its own words; `versions` from the last to the first."""

    tally: TallyFacts
    versions: list[Past]


@router.get("/gyms/{gym}/walls/{wall}/tallies")
def list_tallies(wall: UUID, session: Db, access: GuestMay) -> list[TallyFacts]:
    """Of each route that hangs on a wall."""
    rows = wall_routes(session, wall_of(session, access.gym.id, wall))
    return _told(session, access, [route.id for route, _ in rows])


@router.get("/gyms/{gym}/tallies")
def list_gym_tallies(session: Db, access: GuestMay) -> list[TallyFacts]:
    """Of each route that hangs in the gym."""
    return _told(session, access, [route.id for route, _ in gym_routes(session, access.gym.id)])


@router.get("/gyms/{gym}/routes/{route}/story")
def read_story(route: UUID, session: Db, access: GuestMay) -> Story:
    """Of one route, whether it hangs or not, and the versions of the wall in which it hung."""
    found = route_of(session, access, route)
    placed = session.execute(
        select(Placement, Scan.published_at)
        .join(Scan, Scan.id == Placement.scan_id)
        .where(Placement.route_id == found.id)
        .order_by(Scan.published_at.desc())
    )
    versions = [
        Past(scan_id=row.scan_id, published_at=at, number=row.number, holds=row.holds)
        for row, at in placed
        if at is not None
    ]
    return Story(tally=_told(session, access, [found.id])[0], versions=versions)


def _told(session: Session, access: Access, routes: Iterable[UUID]) -> list[TallyFacts]:
    told = tallies(session, routes)
    voted = set[UUID]()
    if access.actor.person is not None:
        mine = select(Opinion.route_id).where(
            Opinion.person_id == access.actor.person, Opinion.grade != ""
        )
        voted = set(session.scalars(mine.where(Opinion.route_id.in_(told))))
    sees_all = access.role.covers(Role.SETTER)
    return [
        TallyFacts(
            route_id=route, ascents=tally.ascents, climbers=tally.climbers, stars=tally.stars,
            crowd=tally.crowd, votes=sum(tally.grades.values()), wishes=tally.wishes,
            grades=tally.grades if sees_all or route in voted else {},
        )
        for route, tally in told.items()
    ]  # fmt: skip
