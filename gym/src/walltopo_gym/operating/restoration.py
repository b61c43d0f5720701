"""The restoration of a backup over a serving gym: wanted by an operator, carried out by `serve`.

The server stops its workers and closes its database first. Meanwhile it answers every request with
503 (`server/maintenance.py`).
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from urllib.parse import urlsplit

from obstore.exceptions import BaseError
from sqlalchemy.exc import SQLAlchemyError

from walltopo.core import WalltopoError
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.features import open_database
from walltopo_gym.jobs.queue import reason_of
from walltopo_gym.jobs.worker_slot import count_living_workers
from walltopo_gym.migrations.run import migrate
from walltopo_gym.operating.backup_runs import add_ended_run, end_open_runs, work_folder
from walltopo_gym.operating.backup_target import open_target
from walltopo_gym.operating.replacement import check_places, replace_data
from walltopo_gym.operating.setup import UPLOADED, drop_upload
from walltopo_gym.settings import GymSettings

_LOG = logging.getLogger("walltopo_gym.operating")


class Restoration:
    """The backup that a server restores when it stops.

    `stop` stops the server; None: this process cannot restore.
    """

    def __init__(self) -> None:
        self.stop: Callable[[], None] | None = None
        self._lock = Lock()
        self._wanted = ""

    @property
    def wanted(self) -> str:
        """Return the name of the backup; empty: none."""
        return self._wanted

    def begin(self, name: str) -> None:
        """Stop the server, so that it restores a backup.

        Raises
        ------
        ConflictError : another restoration has begun, or this process cannot restore.
        """
        with self._lock:
            if self._wanted or self.stop is None:
                raise ConflictError("upkeep-busy", "upkeep-wait")
            self._wanted = name
            self.stop()


def server_name(settings: GymSettings) -> str:
    """Return the name that an operator types to confirm a restoration."""
    return urlsplit(settings.link_base).hostname or ""


def check_restorable(settings: GymSettings, database: Database, name: str, typed: str) -> None:
    """Check that a backup can be restored over this server.

    Parameters
    ----------
    typed : the server's name, as the operator typed it.

    Raises
    ------
    RequestError : another name was typed. NotFoundError : there is no such backup.
    ConflictError : workers of other processes use the gym.
    InputError : the gym's files are not in its data folder.
    """
    if typed.strip().lower() != server_name(settings):
        raise RequestError("restore-wrong-name", "restore-type-name", name=server_name(settings))
    check_places(settings)
    open_target(settings).find(name)
    own = 1 if settings.workers else 0
    if count_living_workers(settings, database) > own:
        raise ConflictError("gym-in-use", "gym-stop-first")


def carry_out(settings: GymSettings, name: str) -> None:
    """Replace the data by a backup at the target; note the result in the database that stands then.

    A failure leaves the present data.
    """
    error = ""
    try:
        with _source(settings, name) as file:
            replace_data(settings, file)
    except (WalltopoError, BaseError, OSError, SQLAlchemyError) as why:
        error = reason_of(why)
        _LOG.error("%s was not restored: %s", name, error)
    database = open_database(settings)
    try:
        migrate(database)
        with database.writing() as session:
            if not error:
                end_open_runs(session)
            add_ended_run(session, "restore", name, error)
    finally:
        database.close()


@contextmanager
def _source(settings: GymSettings, name: str) -> Iterator[Path]:
    """Yield the file of a backup at the target, or of the uploaded one, which is then deleted."""
    if name == UPLOADED:
        try:
            yield settings.data / UPLOADED
        finally:
            drop_upload(settings)
        return
    target = open_target(settings)
    with work_folder(target, settings) as work, target.local_copy(name, work) as file:
        yield file
