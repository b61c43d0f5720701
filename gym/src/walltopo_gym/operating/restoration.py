"""The restoration of a backup over a serving gym: wanted by an operator, carried out by `serve`.

The server stops its workers and closes its database first. Meanwhile it answers every request with
503 (`server/maintenance.py`).
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Final, NamedTuple
from urllib.parse import urlsplit
from uuid import UUID

from obstore.exceptions import BaseError
from sqlalchemy.exc import SQLAlchemyError

from walltopo.core import WalltopoError
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.features import open_database
from walltopo_gym.jobs.queue import reason_of
from walltopo_gym.jobs.worker_slot import count_living_workers
from walltopo_gym.migrations.run import migrate
from walltopo_gym.operating.backup_runs import add_ended_run, work_folder
from walltopo_gym.operating.backup_target import open_target
from walltopo_gym.operating.replacement import check_places, replace_data
from walltopo_gym.operating.setup import UPLOADED, drop_upload
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.switch_note import NOTE

_LOG = logging.getLogger("walltopo_gym.operating")
_FETCHED: Final = ".fetched"  # in the data folder: a backup from S3


class WantedRestoration(NamedTuple):
    """The name of a backup, and who wants it restored; None: an empty server has no account."""

    name: str
    by: UUID | None


class Restoration:
    """The backup that a server restores when it stops.

    `stop` stops the server; None: this process cannot restore.
    """

    def __init__(self) -> None:
        self.stop: Callable[[], None] | None = None
        self._lock = Lock()
        self._wanted: WantedRestoration | None = None

    @property
    def wanted(self) -> WantedRestoration | None:
        """Return the restoration that is wanted."""
        return self._wanted

    def begin(self, name: str, by: UUID | None) -> None:
        """Stop the server, so that it restores a backup.

        Raises
        ------
        ConflictError : another restoration has begun, or this process cannot restore.
        """
        with self._lock:
            if self._wanted or self.stop is None:
                raise ConflictError("upkeep-busy", "upkeep-wait")
            self._wanted = WantedRestoration(name, by)
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


def carry_out(settings: GymSettings, wanted: WantedRestoration) -> None:
    """Replace the data by a backup at the target; note the result in the database that stands then.

    A failure leaves the present data.

    Raises
    ------
    WalltopoError, SQLAlchemyError : the data are half replaced, and the next start goes on.
    """
    error = ""
    try:
        with _backup_source(settings, wanted.name) as file:
            replace_data(settings, file)
    except (WalltopoError, BaseError, OSError, SQLAlchemyError, sqlite3.Error) as why:
        if (settings.data / NOTE).exists():
            raise
        error = reason_of(why)
        _LOG.error("%s was not restored: %s", wanted.name, error)
    database = open_database(settings)
    try:
        migrate(database)
        with database.writing() as session:
            add_ended_run(session, "restore", wanted.name, error, by=wanted.by)
    finally:
        database.close()


@contextmanager
def _backup_source(settings: GymSettings, name: str) -> Iterator[Path]:
    """Yield the file of a backup at the target, or of the uploaded one, which is then deleted."""
    if name == UPLOADED:
        try:
            yield settings.data / UPLOADED
        finally:
            drop_upload(settings)
        return
    target = open_target(settings)
    with work_folder(settings.data / _FETCHED) as work, target.local_copy(name, work) as file:
        yield file
