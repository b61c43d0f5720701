"""Answer for routes by their ids: their facts, and the people who climbed them."""

from __future__ import annotations

from sqlalchemy import and_, func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.kinds import TOPS
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.events import ClimbedBy, ClimbsById, ListedClimb
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.walls.models import Wall


def routes_by_id(session: Session, question: ClimbsById) -> None:
    """Add the gym's routes, stripped ones included, with their numbers in the published version."""
    rows = session.execute(
        select(Route, Placement.number)
        .join(Wall, Wall.id == Route.wall_id)
        .outerjoin(
            Placement,
            and_(Placement.route_id == Route.id, Placement.scan_id == Wall.published_scan_id),
        )
        .where(Wall.gym_id == question.gym, Route.id.in_(question.ids))
    )
    question.found.extend(
        ListedClimb(
            id=route.id,
            kind="route",
            wall_id=route.wall_id,
            name=route.name,
            colour=route.colour,
            grade_system_id=route.grade_system_id,
            grade=route.grade,
            number=number,
            current=route.stripped_at is None,
        )
        for route, number in rows
    )


def climbed_routes(session: Session, question: ClimbedBy) -> None:
    """Add the first time that each person topped each route."""
    first = (
        select(Ascent.person_id, Ascent.route_id, func.min(Ascent.climbed_at))
        .where(Ascent.route_id.in_(question.climbs), Ascent.person_id.in_(question.people))
        .where(Ascent.kind.in_(TOPS), Ascent.taken_back_at.is_(None))
        .group_by(Ascent.person_id, Ascent.route_id)
    )
    question.found.extend(
        (person, route, at) for person, route, at in session.execute(first) if route
    )
