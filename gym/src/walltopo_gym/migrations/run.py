"""Migrate a database to the tables of this version."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from dbos import DBOS
from sqlalchemy import Connection, text

from walltopo.core import EnvironmentLacksError
from walltopo_gym.database.engine import Database

NEWER_HINT: Final = "Install that version, or restore a backup that this version made."
_LOCK = 0x77616C6C  # any number that nobody else takes: two servers that start at once wait


def _config(connection: Connection | None = None) -> Config:
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent))
    config.attributes["connection"] = connection
    return config


Age = Literal["current", "older", "newer"]


def age_of(database: Database) -> Age:
    """Return whether the tables are those of this version, of an older or of a newer one."""
    with database.engine.connect() as connection:
        found = MigrationContext.configure(connection).get_current_revision()
    known = revisions()
    if found is not None and found not in known:
        return "newer"
    return "current" if found == known[-1] else "older"


def revisions() -> list[str]:
    """Return all revisions in order."""
    script = ScriptDirectory.from_config(_config())
    return [row.revision for row in reversed(list(script.walk_revisions()))]


def migrate(database: Database, to: str = "head") -> None:
    """Create or change the tables, and DBOS's; ours in one transaction, by one process at a time.

    Parameters
    ----------
    to : a revision.

    Raises
    ------
    EnvironmentLacksError : the database was written by a newer version.
    """
    with database.rebuilding() as connection:
        if not database.is_sqlite:  # SQLite's writer is alone anyway
            connection.execute(text(f"SELECT pg_advisory_xact_lock({_LOCK})"))
        try:
            command.upgrade(_config(connection), to)
        except CommandError as error:
            raise EnvironmentLacksError(
                f"a newer version of walltopo-gym made this database ({error})", NEWER_HINT
            ) from error
    if to == "head":
        DBOS.migrate(database.url)
