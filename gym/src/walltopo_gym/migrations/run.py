"""Bring a database to the tables of this version."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection, select, text
from sqlalchemy.orm import Session

from walltopo.core import EnvironmentLacksError
from walltopo_gym.climbing.counting import recount
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.models import Gym

_COUNTED = "0012"  # since this revision sessions and standings are counted from ascents
_LOCK = 0x77616C6C  # any number that nobody else takes: two servers that start at once wait


def _config(connection: Connection | None = None) -> Config:
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent))
    config.attributes["connection"] = connection
    return config


def is_current(database: Database) -> bool:
    """Whether the database has the tables of this version."""
    with database.engine.connect() as connection:
        found = MigrationContext.configure(connection).get_current_revision()
    return found == ScriptDirectory.from_config(_config()).get_current_head()


def migrate(database: Database) -> None:
    """Make or change the tables; in one transaction, by one process at a time.

    Raises
    ------
    EnvironmentLacksError : the database was written by a newer version.
    """
    with database.rebuilding() as connection:
        if not database.is_sqlite:  # SQLite's writer is alone anyway
            connection.execute(text(f"SELECT pg_advisory_xact_lock({_LOCK})"))
        before = MigrationContext.configure(connection).get_current_revision()
        try:
            command.upgrade(_config(connection), "head")
        except CommandError as error:
            raise EnvironmentLacksError(
                f"the database is not of this version ({error})", "Upgrade walltopo-gym."
            ) from error
        if before is not None and before < _COUNTED:
            with Session(connection) as session:
                for gym in session.scalars(select(Gym)).all():
                    recount(session, gym)
                session.commit()
