"""Find the inspections that are due."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.database.engine import Database
from walltopo_gym.events import InspectionDue, publish_event
from walltopo_gym.gyms.days import gym_day, today, zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.inspections.levels import Level, saved_plans
from walltopo_gym.inspections.models import InspectedWall, Inspection, InspectionPlan
from walltopo_gym.walls.lookup import walls_of
from walltopo_gym.walls.models import Wall

_LOG = logging.getLogger("walltopo_gym.inspections")


@dataclass(frozen=True)
class WallDue:
    """The day on which a wall's next inspection of a level is due; `last`: of its last one."""

    wall: Wall
    on: date
    last: date | None


@dataclass(frozen=True)
class LevelDue:
    """The walls of a gym by the day on which an inspection of a level is due, the first first."""

    level: Level
    walls: list[WallDue]

    def due_walls(self, day: date) -> list[WallDue]:
        """Return the walls that are due on a day or before."""
        return [each for each in self.walls if each.on <= day]


def due_levels(session: Session, gym: Gym) -> list[LevelDue]:
    """Return the planned levels of a gym; none until it has saved a plan."""
    plan = session.get(InspectionPlan, gym.id)
    if plan is None:
        return []
    zone = zone_of(gym)
    since = gym_day(plan.created_at, zone)
    walls = walls_of(session, gym.id)
    last = _last_inspections(session, gym.id)
    found = []
    for level in saved_plans(plan):
        if level.interval_days is None:
            continue
        days = []
        for wall in walls:
            at = last.get((level.level, wall.id))
            day = None if at is None else gym_day(at, zone)
            on = since if day is None else day + timedelta(days=level.interval_days)
            days.append(WallDue(wall, on, day))
        found.append(LevelDue(level.level, sorted(days, key=lambda each: each.on)))
    return found


def _last_inspections(session: Session, gym: UUID) -> Mapping[tuple[str, UUID], datetime]:
    """Return when each wall was last inspected, by level. Corrections correct, and inspect not."""
    rows = session.execute(
        select(Inspection.level, InspectedWall.wall_id, func.max(Inspection.finished_at))
        .join(InspectedWall, InspectedWall.inspection_id == Inspection.id)
        .where(
            Inspection.gym_id == gym,
            Inspection.finished_at.is_not(None),
            Inspection.corrects_id.is_(None),
        )
        .group_by(Inspection.level, InspectedWall.wall_id)
    )
    return {(level, wall): at for level, wall, at in rows if at is not None}


def publish_due(database: Database) -> None:
    """Publish the inspections that are due; listeners must bear repetition."""
    with database.reading() as session:
        events = [
            event
            for gym in session.scalars(select(Gym).join(InspectionPlan).order_by(Gym.id))
            if gym.has("inspections")
            for event in _events_of(session, gym)
        ]
    for event in events:
        with database.writing() as session:
            if session.get(Gym, event.gym) is not None:
                publish_event(session, event)


def _events_of(session: Session, gym: Gym) -> list[InspectionDue]:
    """Return a gym's due inspections; none on an error, so that other gyms do not wait."""
    try:
        with session.begin_nested():
            due = [(each.level, each.due_walls(today(gym))) for each in due_levels(session, gym)]
        return [
            InspectionDue(gym.id, level.value, walls[-1].on, tuple(one.wall.name for one in walls))
            for level, walls in due
            if walls
        ]
    except Exception:
        _LOG.exception("gym %s: its due inspections cannot be found", gym.slug)
        return []
