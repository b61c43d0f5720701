"""Competitions, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from sqlalchemy.orm import Session

from walltopo_gym.competitions.calendar import add_dates, publish_beginnings
from walltopo_gym.competitions.demo import hold_cups
from walltopo_gym.competitions.entering import forget_names
from walltopo_gym.competitions.live import LiveBoards
from walltopo_gym.competitions.models import Entry, JudgeLink, ScoreEvent, WaiverSignature
from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.database.engine import Database
from walltopo_gym.events import ComingDates, OwnTables, PersonDeleted
from walltopo_gym.feature import Feature
from walltopo_gym.settings import GymSettings

if TYPE_CHECKING:
    from walltopo_gym.jobs.worker import Chore


def _chores(settings: GymSettings, database: Database) -> Sequence[Chore]:
    from walltopo_gym.jobs.worker import Chore

    return [Chore("competitions-begin", "*/10 * * * *", partial(publish_beginnings, database))]


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.extend(
        [
            ("competition_entries", Entry),
            ("competition_waivers", WaiverSignature),
            ("score_events", ScoreEvent),
            ("competition_judge_links", JudgeLink),
        ]
    )


def _person_deleted(session: Session, event: PersonDeleted) -> None:
    forget_names(session, event.person)


FEATURE = Feature(
    "competitions",
    switch="competitions",
    listeners={ComingDates: (add_dates,), DemoFilled: (hold_cups,)},
    data_listeners={OwnTables: (_own_tables,), PersonDeleted: (_person_deleted,)},
    parts=lambda database: (LiveBoards(database),),
    chores=_chores,
)
