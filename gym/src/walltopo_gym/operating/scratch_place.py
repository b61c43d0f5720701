"""A scratch place for a gym: a folder, and with PostgreSQL a database in the same cluster.

A place that a killed process left behind is removed before the next one is made.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from sqlalchemy import Connection, create_engine, make_url, text
from sqlalchemy.exc import ProgrammingError

from walltopo.core import EnvironmentLacksError
from walltopo_gym.errors import ConflictError
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import private_folder

FOLDER: Final = "scratch"
_LOCKS: Final = 0x77740004  # class of the advisory locks of scratch databases
_MAX_NAME: Final = 63  # bytes of a name in PostgreSQL
_SUFFIX: Final = "_walltopo_scratch"  # a database of this name is dropped
_NOT_ALLOWED: Final = "42501"


@contextmanager
def scratch_place(settings: GymSettings) -> Iterator[GymSettings]:
    """Yield the settings of an empty gym that is deleted after the block.

    The caller holds the lock of the data folder.

    Raises
    ------
    EnvironmentLacksError : PostgreSQL's role may not create a database.
    ConflictError : another process uses the scratch database.
    """
    folder = settings.data / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    try:
        private_folder(folder)
        with _scratch_database(settings) as url:
            yield settings.model_copy(update={"data": folder, "database": url, "objects": ""})
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def check_room(settings: GymSettings, file: Path) -> None:
    """Check that the disk can take what a backup contains.

    Raises
    ------
    EnvironmentLacksError : it cannot.
    """
    needed = file.stat().st_size + settings.keep_free_mb * 1_000_000
    free = shutil.disk_usage(settings.data).free
    if free < needed:
        raise EnvironmentLacksError(
            f"{file}: trying it needs {needed / 1e6:,.0f} MB of free space, {free / 1e6:,.0f} MB"
            " are free",
            "Free some disk space and run again.",
        )


@contextmanager
def _scratch_database(settings: GymSettings) -> Iterator[str]:
    """Yield the URL of a new database; empty for SQLite, whose database is in the folder."""
    url = make_url(settings.database_url)
    if url.get_backend_name() == "sqlite":
        yield ""
        return
    name = (url.database or "")[: _MAX_NAME - len(_SUFFIX)] + _SUFFIX
    engine = create_engine(url, isolation_level="AUTOCOMMIT")
    try:
        with engine.connect() as connection:
            _create_database(connection, name)
            try:
                yield url.set(database=name).render_as_string(hide_password=False)
            finally:
                _drop_database(connection, name)
    finally:
        engine.dispose()


def _create_database(connection: Connection, name: str) -> None:
    """Create a database like the one of the connection, which keeps a lock of its name.

    Raises
    ------
    EnvironmentLacksError, ConflictError : as in `scratch_place`.
    """
    lock = text("SELECT pg_try_advisory_lock(:kind, hashtext(:name))")
    if not connection.scalar(lock, {"kind": _LOCKS, "name": name}):
        raise ConflictError("upkeep-busy", "upkeep-wait")
    role, *place = connection.execute(
        text(
            "SELECT current_user, pg_encoding_to_char(encoding), datcollate, datctype"
            " FROM pg_database WHERE datname = current_database()"
        )
    ).one()
    encoding, collate, ctype = (one.replace("'", "''") for one in place)
    try:
        _drop_database(connection, name)
        connection.exec_driver_sql(
            f"CREATE DATABASE {_quote(name)} TEMPLATE template0 ENCODING '{encoding}'"
            f" LC_COLLATE '{collate}' LC_CTYPE '{ctype}'"
        )
    except ProgrammingError as error:
        if getattr(error.orig, "sqlstate", "") != _NOT_ALLOWED:
            raise
        raise EnvironmentLacksError(
            f"PostgreSQL's role {role} may not create a scratch database",
            f"As an administrator of PostgreSQL: ALTER ROLE {_quote(role)} CREATEDB;",
        ) from error


def _drop_database(connection: Connection, name: str) -> None:
    connection.exec_driver_sql(f"DROP DATABASE IF EXISTS {_quote(name)} WITH (FORCE)")


def _quote(name: str) -> str:
    doubled = name.replace('"', '""')
    return f'"{doubled}"'
