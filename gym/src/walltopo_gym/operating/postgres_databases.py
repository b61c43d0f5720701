"""Databases beside the gym's own in the same PostgreSQL cluster: created, dropped, exchanged."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from sqlalchemy import Connection, create_engine, make_url, text
from sqlalchemy.exc import DBAPIError

from walltopo.core import EnvironmentLacksError
from walltopo_gym.errors import ConflictError
from walltopo_gym.settings import GymSettings

_LOCKS: Final = 0x77740004  # class of the advisory locks of these databases
_MAX_NAME: Final = 63  # bytes of a name in PostgreSQL
_NOT_ALLOWED: Final = "42501"


def is_postgres(settings: GymSettings) -> bool:
    """Return whether the gym's database is in PostgreSQL."""
    return make_url(settings.database_url).get_backend_name() != "sqlite"


def name_beside(settings: GymSettings, ending: str) -> str:
    """Return the name of a database beside the gym's own; one of this name may be dropped."""
    own = (make_url(settings.database_url).database or "").encode()
    return own[: _MAX_NAME - len(ending.encode())].decode(errors="ignore") + ending


def url_of(settings: GymSettings, name: str) -> str:
    """Return the URL of another database of the cluster."""
    url = make_url(settings.database_url).set(database=name)
    return url.render_as_string(hide_password=False)


@contextmanager
def connected(settings: GymSettings, name: str | None = None) -> Iterator[Connection]:
    """Open a connection without a transaction.

    Parameters
    ----------
    name : of the database; None: the gym's own.
    """
    url = settings.database_url if name is None else url_of(settings, name)
    engine = create_engine(url, isolation_level="AUTOCOMMIT")
    try:
        with engine.connect() as connection:
            yield connection
    finally:
        engine.dispose()


def create_database(connection: Connection, name: str) -> None:
    """Create a database like the one of the connection, in the place of an existing one; the
    connection keeps a lock of its name.

    Raises
    ------
    EnvironmentLacksError : the role may not create a database.
    ConflictError : another process has the lock.
    """
    lock = text("SELECT pg_try_advisory_lock(:kind, hashtext(:name))")
    if not connection.scalar(lock, {"kind": _LOCKS, "name": name}):
        raise ConflictError("upkeep-busy", "upkeep-wait")
    place = connection.execute(
        text(
            "SELECT pg_encoding_to_char(encoding), datcollate, datctype"
            " FROM pg_database WHERE datname = current_database()"
        )
    ).one()
    encoding, collate, ctype = (one.replace("'", "''") for one in place)
    with _explained(connection):
        drop_database(connection, name)
        connection.exec_driver_sql(
            f"CREATE DATABASE {quote_name(name)} TEMPLATE template0 ENCODING '{encoding}'"
            f" LC_COLLATE '{collate}' LC_CTYPE '{ctype}'"
        )


def drop_database(connection: Connection, name: str) -> None:
    """Drop a database with all connections to it; a missing one is ignored."""
    connection.exec_driver_sql(f"DROP DATABASE IF EXISTS {quote_name(name)} WITH (FORCE)")


def has_database(connection: Connection, name: str) -> bool:
    """Return whether a database exists."""
    found = text("SELECT 1 FROM pg_database WHERE datname = :name")
    return connection.scalar(found, {"name": name}) is not None


def count_users(settings: GymSettings) -> int:
    """Return the number of connections to the gym's database, without the one that counts."""
    others = text(
        "SELECT count(*) FROM pg_stat_activity"
        " WHERE datname = current_database() AND pid <> pg_backend_pid()"
    )
    with connected(settings) as connection:
        return connection.scalar(others) or 0


def exchange_databases(settings: GymSettings, new: str, aside: str) -> None:
    """Give the gym's name to the database `new`, and the name `aside` to the present one.

    Both in one transaction. Connections to both are ended before.

    Raises
    ------
    EnvironmentLacksError : the role does not own the databases.
    """
    own = make_url(settings.database_url).database or ""
    ended = text(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
        " WHERE datname IN (:own, :new) AND pid <> pg_backend_pid()"
    )
    with connected(settings, "postgres") as connection:
        connection.execute(ended, {"own": own, "new": new})
        with _explained(connection):
            connection.exec_driver_sql("BEGIN")
            for before, after in ((own, aside), (new, own)):
                names = f"{quote_name(before)} RENAME TO {quote_name(after)}"
                connection.exec_driver_sql(f"ALTER DATABASE {names}")
            connection.exec_driver_sql("COMMIT")


@contextmanager
def _explained(connection: Connection) -> Iterator[None]:
    """Raise EnvironmentLacksError in the block if PostgreSQL does not allow a statement."""
    role = connection.scalar(text("SELECT current_user"))
    try:
        yield
    except DBAPIError as error:
        if getattr(error.orig, "sqlstate", "") != _NOT_ALLOWED:
            raise
        raise EnvironmentLacksError(
            f"PostgreSQL's role {role} may not create a database",
            f"As an administrator of PostgreSQL: ALTER ROLE {quote_name(str(role))} CREATEDB;",
        ) from error


def quote_name(name: str) -> str:
    """Return a name of a table or database as SQL has it, also that of SQLite."""
    doubled = name.replace('"', '""')
    return f'"{doubled}"'
