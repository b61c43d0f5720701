"""Grade estimates, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Event
from typing import TYPE_CHECKING

from walltopo_gym.database.engine import Database
from walltopo_gym.events import GradeOutliersOf, GradeRangeOf, ReviewChanged
from walltopo_gym.feature import Feature
from walltopo_gym.grading.placing import PLACES, Placing, queue_missing, review_changed
from walltopo_gym.grading.service import answer_outliers, answer_range
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from walltopo_gym.jobs.queue import Task


def _tasks(
    settings: GymSettings, database: Database, store: FileStore, stopping: Event
) -> Sequence[Task]:
    from walltopo_gym.jobs.queue import Task

    return [Task(PLACES, Placing(database, store).place)]


FEATURE = Feature(
    "grading",
    listeners={
        ReviewChanged: (review_changed,),
        GradeOutliersOf: (answer_outliers,),
        GradeRangeOf: (answer_range,),
    },
    tasks=_tasks,
    start=queue_missing,
)
