"""Exclusion of backup and purge, because one copies files and the other deletes them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from walltopo.core.locks import take_lock
from walltopo_gym.errors import ConflictError
from walltopo_gym.storage.files import private_folder


@contextmanager
def lock_data_folder(data: Path) -> Iterator[None]:
    """Hold the lock of backups and purges of this data folder.

    Raises
    ------
    ConflictError : another process holds it.
    """
    private_folder(data)
    with (data / "upkeep.lock").open("wb") as stream:
        if not take_lock(stream):
            raise ConflictError("upkeep-busy", "upkeep-wait")
        yield
