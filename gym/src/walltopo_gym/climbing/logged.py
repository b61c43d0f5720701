"""A person's ascents of routes, as entries of the log over all gyms."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent
from walltopo_gym.climbing.styles import steepness_of
from walltopo_gym.events import LoggedClimb, LoggedClimbs
from walltopo_gym.gyms.days import gym_day, zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Placement, Route


def logged_routes(session: Session, question: LoggedClimbs) -> None:
    """Add a person's ascents of routes, those of stripped and deleted ones included."""
    mine = question.rows_of(Ascent.person_id, Ascent.climbed_at)
    mine.append(Ascent.taken_back_at.is_(None))
    rows = session.execute(
        select(Ascent, Route, Gym)
        .outerjoin(Route, Route.id == Ascent.route_id)
        .outerjoin(Gym, Gym.id == Ascent.gym_id)
        .where(*mine)
    ).all()
    angles = _steepness_by_route(session, select(Ascent.route_id).where(*mine))
    question.found.extend(_log_entry(ascent, route, gym, angles) for ascent, route, gym in rows)


def _steepness_by_route(session: Session, routes: Select[UUID | None]) -> dict[UUID, float]:
    """Return the mean steepness, in degrees, of each of these routes with a known one."""
    rows = session.execute(
        select(Placement.route_id, func.avg(Placement.steepness_deg))
        .where(Placement.route_id.in_(routes), Placement.steepness_deg.is_not(None))
        .group_by(Placement.route_id)
    )
    return {route: float(degrees) for route, degrees in rows}


def _log_entry(
    ascent: Ascent, route: Route | None, gym: Gym | None, angles: dict[UUID, float]
) -> LoggedClimb:
    at = ascent.climbed_at
    return LoggedClimb(
        id=ascent.id,
        origin="route",
        at=at,
        day=at.date() if gym is None else gym_day(at, zone_of(gym)),
        kind=ascent.kind,
        tries=ascent.tries,
        name=ascent.route_name,
        grade=ascent.grade,
        location=ascent.gym_name,
        note=ascent.note,
        discipline=ascent.discipline,
        high_point=ascent.high_point,
        gym="" if gym is None else gym.slug,
        route=None if route is None else route.id,
        wall=None if route is None else route.wall_id,
        colour="" if route is None else route.colour,
        steepness="" if route is None else steepness_of(angles.get(route.id)),
        current=route is not None and route.stripped_at is None,
    )
