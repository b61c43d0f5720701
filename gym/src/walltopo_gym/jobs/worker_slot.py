"""A worker's slot: its name, and the locks by which others know that it lives.

A lock is held exactly as long as its process lives, whatever ends it, so no heartbeat is needed: a
worker that gets the lock of another one knows that it is gone, and has DBOS restart its workflows.
"""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Final

from dbos import DBOS
from sqlalchemy import Connection, text
from sqlalchemy.exc import SQLAlchemyError

from walltopo.core.locks import open_locked
from walltopo_gym.database.engine import Database
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import private_folder

_LOG = logging.getLogger("walltopo_gym.jobs")
_LOCKS: Final = 0x6A6F6273  # PostgreSQL's class of our workers' locks; any that nobody else takes
# A machine that loses its power says no goodbye; PostgreSQL finds out within 25 s.
_KEEPALIVE: Final = (
    "SET tcp_keepalives_idle = 10; SET tcp_keepalives_interval = 5; SET tcp_keepalives_count = 3"
)


class WorkerSlot:
    """A worker's name, unique among living workers and the same after a restart: the first free one
    of the numbered lock files in the data folder.

    With PostgreSQL, workers may be on several machines: a lock in the database, too, shows workers
    elsewhere that this one lives.
    """

    def __init__(self, settings: GymSettings, database: Database) -> None:
        self.database = database
        self._folder = _folder(settings)
        self._file: IO[bytes] | None = None
        self._connection: Connection | None = None
        self.name = ""

    def __enter__(self) -> WorkerSlot:
        number = 0
        while not self._take(number):
            number += 1
        return self

    def __exit__(self, *_: object) -> None:
        assert self._file is not None
        self._file.close()
        self._drop_connection()

    def _take(self, number: int) -> bool:
        self._file = open_locked(self._folder / f"{number}.lock")
        if self._file is None:
            return False
        if self.database.is_sqlite:  # all workers share a machine, whose name may change
            self.name = f"worker-{number}"
            return True
        self.name = f"{socket.gethostname()}-{number}"
        self._connection = self._lock_in_database(self.name)
        if self._connection is None:
            self._file.close()
        return self._connection is not None

    def hold(self, regained: Callable[[set[str]], None]) -> None:
        """Take the lock in the database again if its connection broke.

        Parameters
        ----------
        regained : receives the ids of the workflows that still belong to this worker; others may
            have restarted the rest meanwhile.
        """
        if self.database.is_sqlite:
            return
        if self._connection is not None:
            with suppress(SQLAlchemyError):
                self._connection.execute(text("SELECT 1"))
                return
            self._drop_connection()
        connection = self._lock_in_database(self.name)
        if connection is None:
            return  # another worker is just looking for this one
        try:
            own = self.database.jobs.list_workflows(
                status="PENDING", executor_id=self.name, load_input=False, load_output=False
            )
            regained({workflow.workflow_id for workflow in own})
        except BaseException:
            _close_connection(connection)
            raise
        self._connection = connection

    def recover(self) -> None:
        """Restart the workflows of dead workers.

        Raises
        ------
        SQLAlchemyError : the database is away.
        """
        with self.database.reading() as session:
            session.execute(text("SELECT 1"))  # DBOS would wait for it, and not end with the worker
        running = self.database.jobs.list_workflows(
            status="PENDING", load_input=False, load_output=False
        )
        others = {workflow.executor_id for workflow in running} - {self.name, None}
        for name in filter(None, others):
            with self._gone(name) as is_gone:
                if is_gone:
                    _LOG.warning("worker %s is gone: others go on with its jobs", name)
                    DBOS._recover_pending_workflows([name])

    @contextmanager
    def _gone(self, name: str) -> Iterator[bool]:
        """Yield whether a worker is dead; it cannot come back during the block."""
        if self.database.is_sqlite:
            lock: IO[bytes] | Connection | None = open_locked(
                self._folder / f"{name.rpartition('-')[2]}.lock"
            )
        else:
            lock = self._lock_in_database(name)
        try:
            yield lock is not None
        finally:
            if isinstance(lock, Connection):
                _close_connection(lock)
            elif lock is not None:
                lock.close()

    def _lock_in_database(self, name: str) -> Connection | None:
        """Take a worker's lock; None while that worker lives. The lock ends with the connection."""
        connection = self.database.engine.connect().execution_options(isolation_level="AUTOCOMMIT")
        try:
            connection.execute(text(_KEEPALIVE))
            take = text("SELECT pg_try_advisory_lock(:kind, hashtext(:name))")
            if connection.scalar(take, {"kind": _LOCKS, "name": name}):
                return connection
        except BaseException:
            connection.close()
            raise
        connection.close()
        return None

    def _drop_connection(self) -> None:
        if self._connection is not None:
            _close_connection(self._connection)
            self._connection = None


def count_living_workers(settings: GymSettings, database: Database) -> int:
    """Return the number of living workers; with SQLite, of this data folder."""
    if database.is_sqlite:
        return sum(_is_held(path) for path in _folder(settings).glob("*.lock"))
    held = text(
        "SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND classid = :kind AND granted"
        " AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
    )
    with database.reading() as session:
        return session.scalar(held, {"kind": _LOCKS}) or 0


def _close_connection(connection: Connection) -> None:
    """Close a connection and so its locks."""
    connection.invalidate()
    connection.close()


def _folder(settings: GymSettings) -> Path:
    folder: Path = private_folder(settings.data) / "workers"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _is_held(path: Path) -> bool:
    lock = open_locked(path)
    if lock is not None:
        lock.close()
    return lock is None
