"""Problems of climbers, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy.orm import Session

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.database.engine import Database
from walltopo_gym.events import ClimbedBy, ClimbsById, LoggedClimbs, OwnTables
from walltopo_gym.feature import Feature
from walltopo_gym.problems.by_id import climbed_problems, problems_by_id
from walltopo_gym.problems.demo import make_problems
from walltopo_gym.problems.logged import logged_problems
from walltopo_gym.problems.models import Problem, ProblemAscent, ProblemReport


def _parts(database: Database) -> Sequence[object]:
    from walltopo_gym.problems.estimate import Estimator

    return [Estimator()]


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.extend(
        [
            ("problems", Problem),
            ("problem_ascents", ProblemAscent),
            ("problem_reports", ProblemReport),
        ]
    )


FEATURE = Feature(
    "problems",
    listeners={DemoFilled: (make_problems,)},
    parts=_parts,
    data_listeners={
        ClimbedBy: (climbed_problems,),
        ClimbsById: (problems_by_id,),
        LoggedClimbs: (logged_problems,),
        OwnTables: (_own_tables,),
    },
)
