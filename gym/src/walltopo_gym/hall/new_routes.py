"""New routes of a gym, and its next dates."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.counting import zone_of
from walltopo_gym.climbing.models import ClimbingSession
from walltopo_gym.climbing.visits import gym_day
from walltopo_gym.clock import now
from walltopo_gym.competitions.calendar import dates_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Plan, Route
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.scans.models import Scan
from walltopo_gym.settings import Feature
from walltopo_gym.walls.models import Wall

MIN: Final = 5  # fewer climbers are not shown: they could be recognised
_AHEAD: Final = timedelta(days=120)


@dataclass(frozen=True)
class Date:
    """An event in the gym.

    Parameters
    ----------
    kind : "reset": new routes come to a wall; "strip": routes of a wall go; "competition".
    id : stable while it is the same event; at : a moment, or a day for an all-day event; end : its
        end, if known.
    name : of the wall or competition; number : of stripped routes.
    path : of its page, below the server's address.
    """

    kind: str
    id: str
    at: datetime | date
    name: str
    path: str
    end: datetime | None = None
    number: int = 0


def today(gym: Gym) -> date:
    """Return the gym's day."""
    return gym_day(now(), zone_of(gym))


def new_routes(session: Session, gym: Gym, days: int, wall: UUID | None = None) -> list[Route]:
    """Return the current routes of at most so many days, the newest first; of one wall, or of
    all."""
    since = today(gym) - timedelta(days=days - 1)
    found = [
        route for route, _ in gym_routes(session, gym.id)
        if route.set_on >= since and wall in (None, route.wall_id)
    ]  # fmt: skip
    return sorted(found, key=lambda route: route.set_on, reverse=True)


def coming(session: Session, gym: Gym, features: Collection[Feature]) -> list[Date]:
    """Return planned dates, the next first."""
    found = [*_resets(session, gym), *_strips(session, gym)]
    if "competitions" in features:
        found += _competitions(session, gym)
    zone = zone_of(gym)

    def order(date: Date) -> tuple[date, str]:
        at = date.at
        return (at.astimezone(zone).date() if isinstance(at, datetime) else at), date.id

    return sorted(found, key=order)


def _resets(session: Session, gym: Gym) -> list[Date]:
    planned = session.execute(
        select(Plan, Wall)
        .join(Scan, Scan.id == Plan.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym.id, Plan.at > now(), Plan.at < now() + _AHEAD, Plan.error == "")
    )
    return [
        Date("reset", f"reset-{plan.scan_id}", plan.at, wall.name, f"/g/{gym.slug}/w/{wall.id}")
        for plan, wall in planned
        if plan.at is not None
    ]


def _strips(session: Session, gym: Gym) -> list[Date]:
    day = today(gym)
    going = session.execute(
        select(Route.strip_on, Wall, func.count())
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym.id, Route.stripped_at.is_(None))
        .where(Route.strip_on >= day, Route.strip_on <= day + _AHEAD)
        .group_by(Route.strip_on, Wall.id)
    )
    return [
        Date("strip", f"strip-{wall.id}-{on}", on, wall.name, f"/g/{gym.slug}/w/{wall.id}",
             number=number)
        for on, wall, number in going
        if on is not None
    ]  # fmt: skip


def _competitions(session: Session, gym: Gym) -> list[Date]:
    return [
        Date("competition", f"competition-{each.competition_id}", each.starts_at, each.name,
             f"/g/{gym.slug}/competitions/{each.competition_id}", each.ends_at)
        for each in dates_of(session, gym.id)
        if (each.ends_at or each.starts_at) > now() and each.starts_at < now() + _AHEAD
    ]  # fmt: skip


def climbers_today(session: Session, gym: Gym) -> int | None:
    """Return the number of climbers today; None below `MIN`."""
    here = select(func.count(ClimbingSession.person_id.distinct())).where(
        ClimbingSession.gym_id == gym.id,
        ClimbingSession.day == today(gym),
        ClimbingSession.ascents > 0,
    )
    number = session.scalar(here) or 0
    return number if number >= MIN else None
