"""Webhooks, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from threading import Event
from typing import TYPE_CHECKING

from walltopo_gym.database.engine import Database
from walltopo_gym.events import RowsExpired
from walltopo_gym.feature import Feature
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore
from walltopo_gym.webhooks.service import COUNTS, DELIVERY, LISTENERS, count_ascents, drop_given_up

if TYPE_CHECKING:
    from walltopo_gym.jobs.queue import Task


def _tasks(
    settings: GymSettings, database: Database, store: FileStore, stopping: Event
) -> Sequence[Task]:
    from walltopo_gym.jobs.queue import Task
    from walltopo_gym.webhooks.delivery import Delivery, record_failure

    return [
        Task(DELIVERY, Delivery(settings, database).deliver, record_failure),
        Task(COUNTS, partial(count_ascents, database)),
    ]


FEATURE = Feature(
    "webhooks",
    listeners=LISTENERS,
    data_listeners={RowsExpired: (drop_given_up,)},
    tasks=_tasks,
)
