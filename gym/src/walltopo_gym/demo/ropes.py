"""The demo gym's ropes: a tower without a scan, its lines and routes, and climbs on them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, time, timedelta
from typing import Final
from uuid import UUID

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_climb.grades.scales import FRENCH
from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.ascents import new_ascent
from walltopo_gym.climbing.kinds import FIRST_TRIES, Kind
from walltopo_gym.crowd.people import email_of
from walltopo_gym.gyms.models import GradeSystem, Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.disciplines import Discipline
from walltopo_gym.walls.models import RopeLine, Wall

_WALL: Final = "Tower"
_LEAD, _TOP_ROPE, _AUTO = Discipline.LEAD, Discipline.TOP_ROPE, Discipline.AUTO_BELAY
_LINES: Final = (("1", (_AUTO,)), ("2", (_TOP_ROPE,)), ("3", (_LEAD, _TOP_ROPE)), ("4", (_LEAD,)))
_ROUTES: Final = (
    ("Lighthouse", "yellow", "4c", 0),
    ("Rope Trick", "green", "5b", 0),
    ("Fog Horn", "red", "5c", 1),
    ("Rust", "blue", "6a", 1),
    ("Crane", "orange", "6a+", 2),
    ("Breakwater", "pink", "6b", 2),
    ("Storm Warning", "black", "6c", 3),
    ("North Sea", "white", "7a", 3),
)
_CLIMBERS: Final = 14
_DAYS: Final = 42
_CLIPS: Final = 9
_SEED: Final = 20_261_129


def make_ropes(session: Session, gym: Gym, climber: UUID, until: datetime) -> None:
    """Add the tower, its lines, routes and climbs, once."""
    if session.scalar(select(Wall.id).where(Wall.gym_id == gym.id, Wall.name == _WALL)):
        return
    grades = [{"label": label} for label in FRENCH]
    system = GradeSystem(gym_id=gym.id, name="French", kind="french", grades=grades)
    wall = Wall(gym_id=gym.id, name=_WALL, place=9)
    session.add_all([system, wall])
    session.flush()
    lines = [
        RopeLine(wall_id=wall.id, label=label, belays=list(belays), points=[])
        for label, belays in _LINES
    ]
    session.add_all(lines)
    session.flush()
    routes = [
        Route(
            wall_id=wall.id,
            name=name,
            colour=colour,
            grade=grade,
            grade_system_id=system.id,
            setter="Nadia",
            set_on=(until - timedelta(days=_DAYS)).date(),
            by_hand=True,
            line_id=lines[line].id,
        )
        for name, colour, grade, line in _ROUTES
    ]
    session.add_all(routes)
    session.flush()
    emails = [email_of(gym, number) for number in range(_CLIMBERS)]
    people = session.scalars(select(Person).where(Person.email.in_(emails)).order_by(Person.email))
    rng = np.random.default_rng(_SEED)
    for person in (*(row.id for row in people), climber):
        _add_climbs(session, gym, person, routes, until, rng)


def _add_climbs(
    session: Session,
    gym: Gym,
    person: UUID,
    routes: Sequence[Route],
    until: datetime,
    rng: np.random.Generator,
) -> None:
    """Add climbs of one person: routes from the easiest up to what they can, and one beyond it."""
    best = int(rng.integers(2, len(routes)))
    for number, route in enumerate(routes[: best + 1]):
        day = (until - timedelta(days=int(rng.integers(1, _DAYS)))).date()
        belays = _LINES[_ROUTES[number][3]][1]
        is_beyond = number == best
        kind = Kind.HIGH_POINT if is_beyond else _random_result(rng)
        session.add(
            new_ascent(
                person,
                gym,
                route,
                kind=kind,
                tries=1 if kind in FIRST_TRIES else int(rng.integers(1, 4)),
                discipline=str(rng.choice(belays)),
                high_point=int(rng.integers(3, _CLIPS)) if is_beyond else None,
                climbed_at=datetime.combine(day, time(17, 30), UTC)
                + timedelta(minutes=int(rng.integers(120))),
            )
        )


def _random_result(rng: np.random.Generator) -> Kind:
    results = (Kind.ONSIGHT, Kind.FLASH, Kind.TOP, Kind.HANG)
    return results[int(rng.choice(len(results), p=(0.3, 0.15, 0.4, 0.15)))]
