"""A scratch place for a gym: a folder, and with PostgreSQL a database in the same cluster.

A place that a killed process left behind is removed before the next one is made.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from walltopo.core import EnvironmentLacksError
from walltopo_gym.operating.backup_entries import tables_size
from walltopo_gym.operating.postgres_databases import (
    connected,
    create_database,
    drop_database,
    is_postgres,
    name_beside,
    url_of,
)
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import private_folder

FOLDER: Final = "scratch"


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
    """Check that the disk can take what a backup contains; the tables are written twice.

    Raises
    ------
    EnvironmentLacksError : it cannot.
    """
    needed = file.stat().st_size + tables_size(file) + settings.keep_free_mb * 1_000_000
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
    if not is_postgres(settings):
        yield ""
        return
    name = name_beside(settings, "_walltopo_scratch")
    with connected(settings) as connection:
        create_database(connection, name)
        try:
            yield url_of(settings, name)
        finally:
            drop_database(connection, name)
