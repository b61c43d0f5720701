"""Problems that the demo's climbers made; the same from the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo.scans.holds import Hold
from walltopo_gym.accounts.models import Person
from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.crowd.people import CLIMBERS, email_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.problems.models import Problem, ProblemAscent
from walltopo_gym.problems.service import store_holds

_SEED: Final = 20260302
_NAMES: Final = (
    "Left hand only",
    "Warm-up",
    "The long way",
    "No pinks",
    "Feet first",
    "Lunch break",
    "Sidestep",
    "Slow and steady",
)
_STEP_M: Final = (0.25, 0.9)  # from one hand hold up to the next


def make_problems(session: Session, event: DemoFilled) -> None:
    """Add problems of the climbers on published walls, once."""
    gym, walls = event.gym, event.walls
    ids = [wall.id for wall in walls]
    if session.scalar(select(func.count()).where(Problem.wall_id.in_(ids))):
        return
    rng = np.random.default_rng(_SEED)
    for number, name in enumerate(_NAMES):
        wall = walls[number % len(walls)]
        assert wall.published_scan_id is not None
        version = event.versions[wall.id]
        holds = [hold for hold in version.by_id.values() if hold.role == "hold"]
        line = _choose_holds(holds, version.unit, rng)
        if len(line) < 3:
            continue
        uses = ["start", *["hand"] * (len(line) - 2), "top"]
        author = _climber(session, gym, int(rng.integers(CLIMBERS)))
        at = event.at - timedelta(days=number + 1)
        problem = Problem(
            wall_id=wall.id,
            scan_id=wall.published_scan_id,
            person_id=author.id,
            name=name,
            share="gym",
            matching=bool(number % 3),
            created_at=at,
            holds=[{"hold": hold.id, "use": use} for hold, use in zip(line, uses, strict=True)],
        )
        session.add(problem)
        session.flush()
        store_holds(session, problem)
        _add_ascents(session, gym, problem, at, rng)


def _choose_holds(holds: Sequence[Hold], unit: float, rng: np.random.Generator) -> list[Hold]:
    """Return holds from a low one upwards, each within reach of the one before."""
    if not holds:
        return []
    low, high = (limit * unit for limit in _STEP_M)
    upwards = sorted(holds, key=lambda hold: hold.position[2])
    line = [upwards[int(rng.integers(max(1, len(upwards) // 3)))]]
    while True:
        here = np.array(line[-1].position)
        steps = [np.array(hold.position) - here for hold in upwards]
        near = [
            hold
            for hold, step in zip(upwards, steps, strict=True)
            if step[2] > low and float(np.linalg.norm(step)) < high
        ]
        if not near:
            return line
        line.append(near[int(rng.integers(len(near)))])


def _add_ascents(
    session: Session, gym: Gym, problem: Problem, at: datetime, rng: np.random.Generator
) -> None:
    for number in rng.choice(CLIMBERS, int(rng.integers(1, 7)), replace=False).tolist():
        person = _climber(session, gym, number)
        session.add(
            ProblemAscent(
                problem_id=problem.id, person_id=person.id, climbed_at=at + timedelta(hours=1)
            )
        )


def _climber(session: Session, gym: Gym, number: int) -> Person:
    return session.scalars(select(Person).where(Person.email == email_of(gym, number))).one()
