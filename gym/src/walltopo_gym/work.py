"""A worker with all that it does: scans, planned publications, webhooks, messages, looks at
photos, places of routes on the grade model."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from walltopo_gym.database.engine import Database
from walltopo_gym.grading import placing
from walltopo_gym.grading.placing import Placing
from walltopo_gym.hall import telling
from walltopo_gym.hall.telling import Telling
from walltopo_gym.mail import make_mailer
from walltopo_gym.publishing.plans import publish_due
from walltopo_gym.scans.stages import ScanSteps
from walltopo_gym.scans.worker import run_worker
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore
from walltopo_gym.uploads import overlap
from walltopo_gym.uploads.overlap import Overlaps
from walltopo_gym.webhooks import delivery
from walltopo_gym.webhooks.delivery import Delivery


def work(
    settings: GymSettings, database: Database, store: FileStore, stop: threading.Event
) -> None:
    """Work until `stop`."""
    chores = (
        partial(publish_due, database),
        Delivery(settings, database).begin_due,
        Overlaps(database, store).begin_asked,
        Placing(database, store).begin_missing,
        Telling(settings, database, make_mailer(settings)).begin_due,
    )
    steps = ScanSteps.of(settings, database, store)
    queues = [delivery.QUEUE, overlap.QUEUE, placing.QUEUE, telling.QUEUE]
    run_worker(steps, stop, chores, queues)


@contextmanager
def at_work(settings: GymSettings, database: Database, store: FileStore) -> Iterator[None]:
    """A worker in a thread of this process, for as long as the block lasts."""
    stop = threading.Event()
    worker = threading.Thread(target=work, args=(settings, database, store, stop), name="worker")
    worker.start()
    try:
        yield
    finally:
        stop.set()
        worker.join()
