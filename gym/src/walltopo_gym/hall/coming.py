"""The next dates of a gym."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from typing import Final

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import ClimbingSession
from walltopo_gym.clock import now
from walltopo_gym.events import ComingDates, GymDate, collect_answers
from walltopo_gym.gyms.days import today, zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Plan, Route
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.models import Wall

MIN: Final = 5  # fewer climbers are not shown: they could be recognised
_AHEAD: Final = timedelta(days=120)


def planned_dates(session: Session, gym: Gym) -> list[GymDate]:
    """Return planned dates, the next first."""
    others = collect_answers(session, ComingDates(gym.id, now() + _AHEAD))
    found = [*_coming_resets(session, gym), *_coming_strips(session, gym), *others]
    zone = zone_of(gym)

    def order(date: GymDate) -> tuple[date, str]:
        at = date.at
        return (at.astimezone(zone).date() if isinstance(at, datetime) else at), date.id

    return sorted(found, key=order)


def _coming_resets(session: Session, gym: Gym) -> list[GymDate]:
    planned = session.execute(
        select(Plan, Wall)
        .join(Scan, Scan.id == Plan.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym.id, Plan.at > now(), Plan.at < now() + _AHEAD, Plan.error == "")
    )
    return [
        GymDate("reset", f"reset-{plan.scan_id}", plan.at, wall.name, f"/g/{gym.slug}/w/{wall.id}")
        for plan, wall in planned
        if plan.at is not None
    ]


def _coming_strips(session: Session, gym: Gym) -> list[GymDate]:
    day = today(gym)
    going = session.execute(
        select(Route.strip_on, Wall, func.count())
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym.id, Route.stripped_at.is_(None))
        .where(Route.strip_on >= day, Route.strip_on <= day + _AHEAD)
        .group_by(Route.strip_on, Wall.id)
    )
    return [
        GymDate(
            "strip",
            f"strip-{wall.id}-{on}",
            on,
            wall.name,
            f"/g/{gym.slug}/w/{wall.id}",
            number=number,
        )
        for on, wall, number in going
        if on is not None
    ]


def climbers_today(session: Session, gym: Gym) -> int | None:
    """Return the number of climbers today; None below `MIN`."""
    here = select(func.count(ClimbingSession.person_id.distinct())).where(
        ClimbingSession.gym_id == gym.id,
        ClimbingSession.day == today(gym),
        ClimbingSession.ascents > 0,
    )
    number = session.scalar(here) or 0
    return number if number >= MIN else None
