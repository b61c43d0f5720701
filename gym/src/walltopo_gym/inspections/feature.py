"""Inspections, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from sqlalchemy.orm import Session

from walltopo_gym.database.engine import Database
from walltopo_gym.events import ClosedWalls, HoldHistoryOf, OwnTables, RowsExpired
from walltopo_gym.feature import Feature
from walltopo_gym.inspections.closed import add_closed
from walltopo_gym.inspections.history import add_marks
from walltopo_gym.inspections.models import Inspection, InspectionEntry, InspectionKey
from walltopo_gym.inspections.retention import drop_old_records
from walltopo_gym.settings import GymSettings

if TYPE_CHECKING:
    from walltopo_gym.jobs.worker import Chore


def _chores(settings: GymSettings, database: Database) -> Sequence[Chore]:
    from walltopo_gym.inspections.due import publish_due
    from walltopo_gym.inspections.retention import drop_unnamed_photos
    from walltopo_gym.jobs.worker import Chore

    return [
        Chore("inspections-due", "*/15 * * * *", partial(publish_due, database)),
        Chore("tidy-inspections", "53 3 * * *", partial(drop_unnamed_photos, settings, database)),
    ]


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.extend(
        [
            ("inspections", Inspection),
            ("inspection_entries", InspectionEntry),
            ("inspection_keys", InspectionKey),
        ]
    )


FEATURE = Feature(
    "inspections",
    switch="inspections",
    listeners={HoldHistoryOf: (add_marks,), ClosedWalls: (add_closed,)},
    data_listeners={OwnTables: (_own_tables,), RowsExpired: (drop_old_records,)},
    chores=_chores,
)
