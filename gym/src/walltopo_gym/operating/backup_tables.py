"""The tables of a backup: dumped, loaded and digested, on SQLite and PostgreSQL.

The digests and the dump come from one snapshot of the database. Thus a restored database can be
compared with what the gym had at that moment, while the gym goes on.
"""

from __future__ import annotations

import hashlib
import sqlite3
import subprocess
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from sqlalchemy import Connection, make_url, text

from walltopo.core import EnvironmentLacksError, InputError
from walltopo_gym.database.engine import Database
from walltopo_gym.migrations.run import NEWER_HINT, revisions
from walltopo_gym.operating.backup_entries import TABLES, TableDigest
from walltopo_gym.operating.postgres_databases import quote_name

# Rows are compared as text, which these settings change.
_ROWS_AS_TEXT: Final = (
    "SET LOCAL DateStyle = 'ISO, MDY'",
    "SET LOCAL IntervalStyle = 'postgres'",
    "SET LOCAL TimeZone = 'UTC'",
    "SET LOCAL bytea_output = 'hex'",
    "SET LOCAL extra_float_digits = 1",
    "SET LOCAL search_path = pg_catalog",
)
_AT_ONCE: Final = 1000  # rows that are fetched together


def tables_entry(database: Database) -> str:
    """Return the name of the entry that has the tables of this kind of database."""
    return TABLES["sqlite" if database.is_sqlite else "postgresql"]


def dump_tables(database: Database, to: Path) -> dict[str, TableDigest]:
    """Write all tables as of one moment to a file; return their digests as of the same moment.

    Raises
    ------
    EnvironmentLacksError : pg_dump is missing or fails.
    """
    if database.is_sqlite:
        with _sqlite_snapshot(database) as source, closing(sqlite3.connect(to)) as copy:
            digests = _sqlite_digests(source)
            source.backup(copy)
        return digests
    with _postgres_snapshot(database) as connection:
        snapshot = connection.scalar(text("SELECT pg_export_snapshot()"))
        _run_program(
            "pg_dump",
            "--format=custom",
            "--no-owner",
            f"--snapshot={snapshot}",
            f"--file={to}",
            f"--dbname={_libpq_address(database)}",
        )
        return _postgres_digests(connection)


def digest_tables(database: Database) -> dict[str, TableDigest]:
    """Return the digest of each table by its name."""
    if database.is_sqlite:
        with _sqlite_snapshot(database) as source:
            return _sqlite_digests(source)
    with _postgres_snapshot(database) as connection:
        return _postgres_digests(connection)


def check_tables(database: Database, source: Path, tables: Path) -> None:
    """Check that a file has the tables of a gym, as this kind of database writes them.

    Parameters
    ----------
    source : the backup, for messages.

    Raises
    ------
    InputError : it has not. EnvironmentLacksError : pg_restore is missing.
    """
    if database.is_sqlite:
        try:
            address = f"{tables.absolute().as_uri()}?mode=ro&immutable=1"
            with closing(sqlite3.connect(address, uri=True)) as copy:
                found = copy.execute("SELECT version_num FROM alembic_version").fetchall()
        except sqlite3.DatabaseError as error:
            raise InputError(f"{source}: its database is not a gym's ({error})") from error
        if not {version for (version,) in found} <= set(revisions()):
            raise EnvironmentLacksError(
                f"{source}: a newer version of walltopo-gym made this backup", NEWER_HINT
            )
        return
    listing = _end_of("pg_restore", "--list", str(tables))
    if listing.returncode or " TABLE DATA public alembic_version " not in listing.stdout:
        raise InputError(f"{source}: its database is not a gym's", listing.stderr.strip()[-500:])


def load_tables(database: Database, source: Path) -> None:
    """Fill an empty database from a file of `dump_tables`.

    Raises
    ------
    EnvironmentLacksError : pg_restore is missing or fails.
    """
    if database.is_sqlite:
        with (
            closing(sqlite3.connect(source)) as copy,
            closing(sqlite3.connect(_sqlite_file(database))) as target,
        ):
            copy.backup(target)
    else:
        _run_program(
            "pg_restore",
            "--no-owner",
            "--exit-on-error",
            "--single-transaction",
            f"--dbname={_libpq_address(database)}",
            str(source),
        )


@contextmanager
def _sqlite_snapshot(database: Database) -> Iterator[sqlite3.Connection]:
    """Open a connection that reads the database as of one moment."""
    with closing(sqlite3.connect(_sqlite_file(database), isolation_level=None)) as connection:
        connection.text_factory = bytes  # a text that is not UTF-8 has a digest, too
        connection.execute("BEGIN")
        connection.execute("SELECT count(*) FROM sqlite_master")  # the moment is that of a read
        yield connection


def _sqlite_digests(connection: sqlite3.Connection) -> dict[str, TableDigest]:
    listed = connection.execute(
        "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite\\_%'"
        " ESCAPE '\\' ORDER BY name"
    )
    names = [name.decode() for (name,) in listed.fetchall()]
    found = {}
    for name in names:
        rows = connection.execute(f"SELECT * FROM {quote_name(name)}")
        found[name] = _digest_rows(repr(row).encode() for row in rows)
    return found


@contextmanager
def _postgres_snapshot(database: Database) -> Iterator[Connection]:
    """Open a connection that reads the database as of one moment."""
    with database.engine.connect() as connection:
        one = connection.execution_options(isolation_level="REPEATABLE READ")
        with one.begin():
            for setting in _ROWS_AS_TEXT:
                one.execute(text(setting))
            yield one


def _postgres_digests(connection: Connection) -> dict[str, TableDigest]:
    listed = connection.execute(
        text(
            "SELECT schemaname, tablename FROM pg_tables WHERE schemaname <> 'information_schema'"
            " AND schemaname NOT LIKE 'pg\\_%' ORDER BY schemaname, tablename"
        )
    )
    found = {}
    for schema, table in listed.all():
        place = f"{quote_name(schema)}.{quote_name(table)}"
        rows = f"SELECT walltopo_row::text FROM {place} walltopo_row"
        streamed = connection.execution_options(yield_per=_AT_ONCE).exec_driver_sql(rows)
        found[f"{schema}.{table}"] = _digest_rows(row.encode() for row in streamed.scalars())
    return found


def _digest_rows(rows: Iterable[bytes]) -> TableDigest:
    """Return the number of rows and the sum of their hashes, which no order changes."""
    count = total = 0
    for row in rows:
        count += 1
        total += int.from_bytes(hashlib.sha256(row).digest(), "big")
    return TableDigest(count, f"{total % (1 << 256):064x}")


def _sqlite_file(database: Database) -> str:
    return str(make_url(database.url).database)


def _libpq_address(database: Database) -> str:
    url = make_url(database.url).set(drivername="postgresql")
    return url.render_as_string(hide_password=False)


def _end_of(program: str, *words: str) -> subprocess.CompletedProcess[str]:
    """Return a program's exit code and what it printed.

    Raises
    ------
    EnvironmentLacksError : the program is missing.
    """
    try:
        return subprocess.run([program, *words], capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise EnvironmentLacksError(
            f"{program} is not here", "Install PostgreSQL's client programs."
        ) from error


def _run_program(program: str, *words: str) -> None:
    ended = _end_of(program, *words)
    if ended.returncode:
        raise EnvironmentLacksError(f"{program} failed: {ended.stderr.strip()[-500:]}")
