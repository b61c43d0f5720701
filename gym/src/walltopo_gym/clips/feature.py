"""Clips of attempts, as a feature of the platform."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from sqlalchemy.orm import Session

from walltopo_gym.clips.models import Clip, FilmReport
from walltopo_gym.clips.service import CLIPS, clips_in
from walltopo_gym.database.engine import Database
from walltopo_gym.events import OwnTables, TookPart
from walltopo_gym.feature import Feature
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from walltopo_gym.jobs.queue import Task
    from walltopo_gym.jobs.worker import Chore


def _tasks(
    settings: GymSettings, database: Database, store: FileStore, stopping: threading.Event
) -> Sequence[Task]:
    from walltopo_gym.clips.reading import ClipReadings, record_failure
    from walltopo_gym.jobs.queue import Task

    readings = ClipReadings(settings, database, store, stopping)
    return [Task(CLIPS, readings.read, record_failure)]


def _chores(settings: GymSettings, database: Database) -> Sequence[Chore]:
    from walltopo_gym.clips.reading import tidy
    from walltopo_gym.jobs.worker import Chore

    return [Chore("tidy-clips", "41 * * * *", partial(tidy, settings, database))]


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.extend([("clips", Clip), ("film_reports", FilmReport)])


def _took_part(session: Session, question: TookPart) -> None:
    """Answer whether a person has clips of a gym's routes."""
    mine = clips_in(question.gym, question.person)
    question.found.append(session.scalar(mine.limit(1)) is not None)


FEATURE = Feature(
    "clips",
    switch="clips",
    data_listeners={OwnTables: (_own_tables,), TookPart: (_took_part,)},
    tasks=_tasks,
    chores=_chores,
)
