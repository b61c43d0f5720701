"""Reports of holds, as a feature of the platform."""

from __future__ import annotations

from sqlalchemy import update
from sqlalchemy.orm import Session

from walltopo_gym.events import HoldHistoryOf, HoldMarked, OwnTables, PersonDeleted
from walltopo_gym.feature import Feature
from walltopo_gym.hold_reports.marked import add_reports, close_marked
from walltopo_gym.hold_reports.models import HoldReport


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.append(("hold_reports", HoldReport))


def _person_deleted(session: Session, event: PersonDeleted) -> None:
    """Delete the person's words; the reports stay."""
    own = update(HoldReport).where(HoldReport.person_id == event.person)
    session.execute(own.values(note=""))


FEATURE = Feature(
    "hold_reports",
    listeners={HoldHistoryOf: (add_reports,), HoldMarked: (close_marked,)},
    data_listeners={OwnTables: (_own_tables,), PersonDeleted: (_person_deleted,)},
)
