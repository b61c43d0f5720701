"""A person's ascents of problems, as entries of the log over all gyms."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.events import LoggedClimb, LoggedClimbs
from walltopo_gym.gyms.days import gym_day, zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.problems.models import Problem, ProblemAscent
from walltopo_gym.walls.models import Wall


def logged_problems(session: Session, question: LoggedClimbs) -> None:
    """Add the problems that a person has climbed, those of other people included.

    A problem that its author deleted keeps its day and gym.
    """
    mine = question.rows_of(ProblemAscent.person_id, ProblemAscent.climbed_at)
    mine.append(ProblemAscent.climbed_at.is_not(None))
    rows = session.execute(
        select(ProblemAscent.climbed_at, Problem, Gym)
        .join(Problem, Problem.id == ProblemAscent.problem_id)
        .join(Wall, Wall.id == Problem.wall_id)
        .join(Gym, Gym.id == Wall.gym_id)
        .where(*mine)
    )
    question.found.extend(
        LoggedClimb(
            id=problem.id,
            origin="problem",
            at=at,
            day=gym_day(at, zone_of(gym)),
            kind="top",
            tries=1,
            name=problem.name,
            grade=problem.grade,
            location=gym.name,
            gym=gym.slug,
            wall=problem.wall_id,
            current=problem.taken_back_at is None,
        )
        for at, problem, gym in rows
        if at is not None
    )
