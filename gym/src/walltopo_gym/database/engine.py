"""Connections and transactions, the same to the caller on SQLite and PostgreSQL.

The code is synchronous: SQLite's driver is, Pillow is, the jobs are, and threads serve a hundred
reads a second with room to spare. One colour of function is less to get wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, make_url
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

_WRITES = "walltopo_writes"
_REBUILDS = "walltopo_rebuilds"
_TURN = "walltopo_turn"
_BUSY_S = 20


class Database:
    """One database.

    Parameters
    ----------
    url : SQLAlchemy's.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self.is_sqlite = make_url(url).get_backend_name() == "sqlite"
        self.engine = _sqlite(url) if self.is_sqlite else _postgres(url)
        self._writing = self.engine.execution_options(**{_WRITES: True})

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """One consistent view; nothing is kept of what the block changes."""
        with Session(self.engine) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """One transaction: all of the block, or nothing of it."""
        # Values read before the commit stay readable after it.
        with Session(self._writing, expire_on_commit=False) as session, session.begin():
            yield session

    @contextmanager
    def rebuilding(self) -> Iterator[Connection]:
        """One transaction that changes tables.

        SQLite makes a table anew for that and drops the old one; its rows' references shall not
        go with it, so they are not watched meanwhile.
        """
        engine = self._writing.execution_options(**{_REBUILDS: True})
        with engine.begin() as connection:
            yield connection
            if self.is_sqlite and connection.exec_driver_sql("PRAGMA foreign_key_check").first():
                raise RuntimeError("the new tables would have references that lead to nothing")
        self.engine.dispose()  # with the connections that do not watch references

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()


def _postgres(url: str) -> Engine:
    return create_engine(url, pool_size=20, max_overflow=20, pool_pre_ping=True)


def _sqlite(url: str) -> Engine:
    # isolation_level None: BEGIN is ours (see `_begin`), not the driver's.
    how = {"timeout": _BUSY_S, "isolation_level": None}
    engine = create_engine(url, pool_size=20, max_overflow=20, connect_args=how)
    turn = Lock()

    def begin(connection: Connection) -> None:
        """A writer takes the lock at once: one that began as a reader could only be refused later.
        This process's writers wait here for each other: SQLite lets in who happens to ask in the
        right moment, and under a crowd some of them never would."""
        options = connection.get_execution_options()
        if options.get(_REBUILDS, False):
            connection.exec_driver_sql("PRAGMA foreign_keys = OFF")
        if options.get(_WRITES, False):
            connection.info[_TURN] = turn.acquire(timeout=_BUSY_S)
            connection.exec_driver_sql("BEGIN IMMEDIATE")
        else:
            connection.exec_driver_sql("BEGIN")

    def end(_: object, record: ConnectionPoolEntry) -> None:
        """The connection is given back, whatever became of its transaction."""
        if record.info.pop(_TURN, False):
            turn.release()

    event.listen(engine, "connect", _prepare)
    event.listen(engine, "begin", begin)
    event.listen(engine, "checkin", end)
    return engine


def _prepare(connection: Any, record: object) -> None:
    cursor = connection.cursor()
    cursor.execute("PRAGMA journal_mode = WAL")
    # FULL: what was acknowledged survives a power cut, too.
    cursor.execute("PRAGMA synchronous = FULL")
    cursor.execute("PRAGMA foreign_keys = ON")
    cursor.close()
