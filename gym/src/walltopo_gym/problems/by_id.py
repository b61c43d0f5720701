"""Answer for problems by their ids: their facts, and the people who climbed them."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.sharing import may_see
from walltopo_gym.events import ClimbedBy, ClimbsById, ListedClimb
from walltopo_gym.problems.models import Problem, ProblemAscent
from walltopo_gym.walls.models import Wall


def problems_by_id(session: Session, question: ClimbsById) -> None:
    """Add the gym's problems that the person may see."""
    rows = session.scalars(
        select(Problem)
        .join(Wall, Wall.id == Problem.wall_id)
        .where(Wall.gym_id == question.gym, Problem.id.in_(question.ids))
        .where(Problem.taken_back_at.is_(None))
    )
    question.found.extend(
        ListedClimb(
            id=row.id,
            kind="problem",
            wall_id=row.wall_id,
            name=row.name,
            colour="",
            grade_system_id=row.grade_system_id,
            grade=row.grade,
            number=None,
            current=True,
        )
        for row in rows
        if may_see(row, question.person, is_member=question.is_member, is_setter=question.is_setter)
    )


def climbed_problems(session: Session, question: ClimbedBy) -> None:
    """Add the first time that each person climbed each problem."""
    first = select(
        ProblemAscent.person_id, ProblemAscent.problem_id, ProblemAscent.climbed_at
    ).where(
        ProblemAscent.problem_id.in_(question.climbs),
        ProblemAscent.person_id.in_(question.people),
        ProblemAscent.climbed_at.is_not(None),
    )
    question.found.extend(
        (person, problem, at) for person, problem, at in session.execute(first) if at is not None
    )
