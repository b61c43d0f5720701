"""Connections and transactions, the same to the caller on SQLite and PostgreSQL.

The code is synchronous, because SQLite's driver, Pillow and the jobs are, and threads serve a
hundred reads a second with room to spare.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from threading import Lock
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import Connection, Engine, create_engine, event, make_url, text
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.dialects.postgresql import Insert
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

from walltopo_gym.database.lock import write_open

if TYPE_CHECKING:
    from dbos import DBOSClient

APPLICATION: Final = "walltopo-gym"  # whose jobs they are, to DBOS
_WRITES = "walltopo_writes"
_REBUILDS = "walltopo_rebuilds"
_TURN = "walltopo_turn"
_BUSY_S = 20
_TURNS: Final = 0x77740003  # class of the advisory locks of `take_turn`
# Functions that events and questions (`events.py`) call, by the class of the event or question.
Listener = Callable[[Session, Any], None]
Listeners = Mapping[type, Sequence[Listener]]
_NONE: Final[Listeners] = MappingProxyType({})
CONNECTIONS: Final = 20  # kept open; as many again while more are needed


class Database:
    """One database.

    Parameters
    ----------
    url : SQLAlchemy's.
    listeners : by the class of what they listen to (`events.py`).
    """

    def __init__(self, url: str, listeners: Listeners = _NONE) -> None:
        self.url = url
        self.listeners = listeners
        self.is_sqlite = make_url(url).get_backend_name() == "sqlite"
        self.engine = _sqlite(url) if self.is_sqlite else _postgres(url)
        self._writing = self.engine.execution_options(**{_WRITES: True})

    @cached_property
    def jobs(self) -> DBOSClient:
        """Return DBOS's view of its tables in this database."""
        from dbos import DBOSClient

        return DBOSClient(
            system_database_engine=self._writing, application_name=APPLICATION, lazy=True
        )

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Open a session with one consistent view; changes in the block are discarded."""
        with Session(self.engine, info={"database": self}) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """Open one transaction: all of the block is committed, or nothing."""
        # Values read before the commit stay readable after it.
        made = Session(self._writing, expire_on_commit=False, info={"database": self})
        with write_open(), made as session, session.begin():
            yield session

    @contextmanager
    def rebuilding(self) -> Iterator[Connection]:
        """Open one transaction that changes tables.

        SQLite copies the table and drops the old one. Foreign keys are off meanwhile, so that
        references to its rows survive.
        """
        engine = self._writing.execution_options(**{_REBUILDS: True})
        with engine.begin() as connection:
            yield connection
            if self.is_sqlite and connection.exec_driver_sql("PRAGMA foreign_key_check").first():
                raise RuntimeError("the new tables would have references that lead to nothing")
        self.engine.dispose()  # with the connections that do not watch references

    @contextmanager
    def turn_of(self, subject: str) -> Iterator[None]:
        """Wait until no other server has the turn of `subject`, and keep it during the block,
        without a transaction. SQLite is one server's."""
        if self.is_sqlite:
            yield
            return
        facts = {"kind": _TURNS, "subject": subject}
        options = {"isolation_level": "AUTOCOMMIT"}
        with self.engine.connect().execution_options(**options) as connection:
            connection.execute(text("SELECT pg_advisory_lock(:kind, hashtext(:subject))"), facts)
            try:
                yield
            finally:
                ended = text("SELECT pg_advisory_unlock(:kind, hashtext(:subject))")
                connection.execute(ended, facts)

    def insert(self, table: type[Any]) -> Insert:
        """Return an insertion that supports `on_conflict_do_...`."""
        if self.is_sqlite:
            return sqlite.insert(table)  # type: ignore[return-value] # it says the same
        return postgresql.insert(table)

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()


def take_turn(session: Session, subject: str) -> None:
    """Wait until no other transaction has the turn of `subject`, and keep it until this one ends.

    A number that is counted afterwards still holds when this transaction adds to it. SQLite's
    writers wait for each other anyway.
    """
    database: Database = session.info["database"]
    if not database.is_sqlite:
        lock = text("SELECT pg_advisory_xact_lock(:kind, hashtext(:subject))")
        session.execute(lock, {"kind": _TURNS, "subject": subject})


def _postgres(url: str) -> Engine:
    # Values of a statement that failed stay out of the log: they are people's.
    return create_engine(
        url,
        pool_size=CONNECTIONS,
        max_overflow=CONNECTIONS,
        pool_pre_ping=True,
        hide_parameters=True,
    )


def _sqlite(url: str) -> Engine:
    # isolation_level None: BEGIN is ours (see `_begin`), not the driver's.
    how = {"timeout": _BUSY_S, "isolation_level": None}
    engine = create_engine(
        url,
        pool_size=CONNECTIONS,
        max_overflow=CONNECTIONS,
        connect_args=how,
        hide_parameters=True,
    )
    turn = Lock()

    def begin(connection: Connection) -> None:
        """Take the write lock at once, because upgrading a read lock may fail. Writers of this
        process queue here, because SQLite grants the lock to the one that polls at the right
        moment, and some writers under load would never get it."""
        options = connection.get_execution_options()
        if options.get(_REBUILDS, False):
            connection.exec_driver_sql("PRAGMA foreign_keys = OFF")
        if options.get(_WRITES, False):
            connection.info[_TURN] = turn.acquire(timeout=_BUSY_S)
            connection.exec_driver_sql("BEGIN IMMEDIATE")
        else:
            connection.exec_driver_sql("BEGIN")

    def end(_: object, record: ConnectionPoolEntry) -> None:
        """Release the queue when the connection is returned, whatever became of its transaction."""
        if record.info.pop(_TURN, False):
            turn.release()

    event.listen(engine, "connect", _set_connection_options)
    event.listen(engine, "begin", begin)
    event.listen(engine, "checkin", end)
    return engine


def _set_connection_options(connection: Any, record: object) -> None:
    cursor = connection.cursor()
    cursor.execute("PRAGMA journal_mode = WAL")
    # FULL: what was acknowledged survives a power cut, too.
    cursor.execute("PRAGMA synchronous = FULL")
    cursor.execute("PRAGMA foreign_keys = ON")
    cursor.close()
