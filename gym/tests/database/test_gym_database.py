"""The tables are what the classes say, on both databases; transactions are whole."""

from __future__ import annotations

from datetime import date, datetime
from graphlib import TopologicalSorter
from json import dumps
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from gym.tests.worlds import Server, new_database
from sqlalchemy import Column, MetaData, func, select, text
from sqlalchemy.sql import sqltypes
from tests.at_once import at_once

from walltopo.core import EnvironmentLacksError
from walltopo_gym.accounts.models import Try
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.migrations.run import age_of, migrate, revisions
from walltopo_gym.migrations.tables import METADATA, is_ours
from walltopo_gym.operating.doctor import examine
from walltopo_gym.problems.models import ProblemHold
from walltopo_gym.settings import load_settings

pytestmark = pytest.mark.both_databases("migrations and constraints")

KEY = UUID(int=1)
COMPARED = {"compare_type": True, "include_name": is_ours}


def test_the_migrations_make_the_tables_that_the_classes_declare(server: Server) -> None:
    with server.database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts=COMPARED)
        assert compare_metadata(context, METADATA) == []
    assert age_of(server.database) == "current"


@pytest.mark.parametrize("revision", revisions())
def test_an_upgrade_keeps_every_row(server: Server, tmp_path: Path, revision: str) -> None:
    """From each revision, with a row in each of its tables, to the tables of this version."""
    database = old_database(server, tmp_path)
    try:
        migrate(database, revision)
        tables = fill(database)
        migrate(database)
        with database.engine.connect() as connection:
            context = MigrationContext.configure(connection, opts=COMPARED)
            assert compare_metadata(context, METADATA) == []
            kept = {
                name: connection.scalar(text(f'SELECT count(*) FROM "{name}"')) for name in tables
            }
        assert set(kept.values()) == {1}
        assert len(kept) >= 57
    finally:
        database.close()


def old_database(server: Server, folder: Path) -> Database:
    """Return an empty database of the server's kind."""
    url = server.database.engine.url
    if server.database.is_sqlite:
        return Database(f"sqlite:///{folder / 'old.sqlite'}")
    return Database(new_database(f"{url.username}@{url.host}:{url.port}"))


def fill(database: Database) -> list[str]:
    """Write one row into each table as the database declares it; return the tables' names.

    Columns that may be empty stay so, for walls and scans refer to each other.
    """
    metadata = MetaData()
    metadata.reflect(database.engine)
    metadata.remove(metadata.tables["alembic_version"])
    needs = {
        table.name: {
            key.column.table.name
            for key in table.foreign_keys
            if not key.parent.nullable and key.column.table is not table
        }
        for table in metadata.tables.values()
    }
    order = list(TopologicalSorter(needs).static_order())
    with database.engine.begin() as connection:
        for table in map(metadata.tables.__getitem__, order):
            row = {column.name: _value(column) for column in table.columns if not column.nullable}
            connection.execute(table.insert().values(row))
    return order


def _value(column: Column[Any]) -> object:
    """Return a value of the column's type: of a key always the same, so that references hold."""
    if isinstance(column.type, sqltypes.JSON):
        return {}
    kind = column.type.python_type
    if isinstance(column.type, sqltypes.CHAR):  # how SQLite keeps a UUID
        return KEY.hex
    return {
        UUID: KEY,
        bool: True,
        datetime: now(),
        date: now().date(),
        int: 1,
        float: 1.0,
        bytes: b"a",
    }.get(kind, "a")


def test_an_upgrade_finds_old_problems_by_their_holds(server: Server, tmp_path: Path) -> None:
    database = old_database(server, tmp_path)
    try:
        migrate(database, "0011")
        fill(database)
        holds = [{"hold": 7, "use": "start"}, {"hold": 9, "use": "top"}]
        with database.engine.begin() as connection:
            connection.execute(text("UPDATE problems SET holds = :holds"), {"holds": dumps(holds)})
        migrate(database)
        with database.reading() as session:
            rows = session.execute(select(ProblemHold.problem_id, ProblemHold.hold)).all()
        assert sorted(rows) == [(KEY, 7), (KEY, 9)]
    finally:
        database.close()


def test_migrating_again_changes_nothing(server: Server) -> None:
    migrate(server.database)
    assert age_of(server.database) == "current"


def test_a_newer_database_is_left_alone(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'new.sqlite'}")
    migrate(database)
    with database.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(EnvironmentLacksError, match="newer version"):
        migrate(database)
    assert age_of(database) == "newer"
    database.close()


@pytest.mark.parametrize(
    ("revision", "state", "words"),
    [("9999", "bad", "a newer version"), ("0001", "look", "`walltopo gym migrate`")],
)
def test_the_doctor_says_which_version_made_the_database(
    tmp_path: Path, revision: str, state: str, words: str
) -> None:
    database = Database(f"sqlite:///{tmp_path / 'gym.sqlite'}")
    migrate(database)
    with database.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = :to"), {"to": revision})
    database.close()
    found = next(examine(load_settings({"data": tmp_path}, {})))
    assert (found.what, found.state) == ("database", state)
    assert words in found.message


def test_a_block_that_fails_leaves_nothing(server: Server) -> None:
    def fail() -> None:
        with server.database.writing() as session:
            session.add(Try(key="half", at=now()))
            session.flush()
            raise RuntimeError("in the middle")

    with pytest.raises(RuntimeError, match="middle"):
        fail()
    with server.database.reading() as session:
        assert session.scalar(select(Try).where(Try.key == "half")) is None


def test_writers_wait_for_each_other(server: Server) -> None:
    """Eight that read and then write at the same time: none is refused, none is lost."""

    def add() -> None:
        for _ in range(5):
            with server.database.writing() as session:
                session.scalar(select(func.count()).select_from(Try))
                session.add(Try(key="crowd", at=now()))

    at_once(*8 * [add])
    with server.database.reading() as session:
        rows = select(func.count()).select_from(Try).where(Try.key == "crowd")
        assert session.scalar(rows) == 40
