"""The tables are what the classes say, on both databases; transactions are whole."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from gym.tests.worlds import Server
from sqlalchemy import func, select, text

from walltopo.core import EnvironmentLacksError
from walltopo_gym.accounts.models import Try
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.migrations.run import is_current, migrate
from walltopo_gym.migrations.tables import METADATA


def test_the_migrations_make_the_tables_that_the_classes_declare(server: Server) -> None:
    with server.database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, METADATA) == []
    assert is_current(server.database)


def test_migrating_again_changes_nothing(server: Server) -> None:
    migrate(server.database)
    assert is_current(server.database)


def test_a_newer_database_is_left_alone(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'new.sqlite'}")
    migrate(database)
    with database.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(EnvironmentLacksError, match="Upgrade"):
        migrate(database)
    database.close()


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

    threads = [threading.Thread(target=add) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with server.database.reading() as session:
        rows = select(func.count()).select_from(Try).where(Try.key == "crowd")
        assert session.scalar(rows) == 40
