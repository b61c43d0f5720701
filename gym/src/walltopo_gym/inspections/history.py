"""The marks of a hold, for its history."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.events import HoldHistoryOf, HoldMoment
from walltopo_gym.inspections.models import InspectionEntry


def add_marks(session: Session, question: HoldHistoryOf) -> None:
    """Answer with the latest marks of a hold."""
    rows = session.execute(
        select(InspectionEntry, Person.name)
        .outerjoin(Person, Person.id == InspectionEntry.person_id)
        .where(question.rows_of(InspectionEntry.scan_id, InspectionEntry.hold))
        .order_by(InspectionEntry.made_at.desc())
        .limit(question.most)
    )
    question.found.extend(
        HoldMoment(row.made_at, row.mark, row.note, name or "", inspection=row.inspection_id)
        for row, name in rows
    )
