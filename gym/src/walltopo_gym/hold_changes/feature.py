"""Holds that changed since the last scan, as a feature of the platform."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

from walltopo_gym.database.engine import Database
from walltopo_gym.events import HoldHistoryOf, WallPublished
from walltopo_gym.feature import Feature
from walltopo_gym.hold_changes.comparing import (
    COMPARISONS,
    HoldComparisons,
    record_failure,
    wall_published,
)
from walltopo_gym.hold_changes.history import add_changes
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from walltopo_gym.jobs.queue import Task


def _tasks(
    settings: GymSettings, database: Database, store: FileStore, stopping: threading.Event
) -> Sequence[Task]:
    from walltopo_gym.jobs.queue import Task

    return [Task(COMPARISONS, HoldComparisons(database, store, stopping).compare, record_failure)]


FEATURE = Feature(
    "hold_changes",
    listeners={HoldHistoryOf: (add_changes,), WallPublished: (wall_published,)},
    tasks=_tasks,
)
