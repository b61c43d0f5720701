"""Planned resets, as a feature of the platform."""

from __future__ import annotations

from sqlalchemy.orm import Session

from walltopo_gym.events import OwnTables
from walltopo_gym.feature import Feature
from walltopo_gym.reset_plans.models import GradeProposal, ResetPerson, SignOff


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.extend(
        [
            ("reset_plans", ResetPerson),
            ("grade_proposals", GradeProposal),
            ("sign_offs", SignOff),
        ]
    )


FEATURE = Feature("reset_plans", data_listeners={OwnTables: (_own_tables,)})
