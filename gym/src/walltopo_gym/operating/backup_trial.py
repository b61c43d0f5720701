"""The trial of a backup: restored into a scratch place and compared with what the gym had.

The backup lists the digest of each table and the hash of each file, computed from the gym when the
backup was made. The trial computes them anew from the restored gym.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import Final

from walltopo_gym.database.engine import Database
from walltopo_gym.migrations.run import migrate
from walltopo_gym.operating.backup import Progress, load_backup, no_report
from walltopo_gym.operating.backup_entries import TableDigest
from walltopo_gym.operating.backup_tables import digest_tables
from walltopo_gym.operating.scratch_place import check_room, scratch_place
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, open_store

_MAX: Final = 10  # differences that are listed


@dataclass(frozen=True)
class Trial:
    """The result of a trial.

    Parameters
    ----------
    rows, tables, files : restored ones.
    differences : the first differences between the backup's list and what was restored.
    has_tables : whether the backup lists its tables; older ones do not.
    made_at, version : when the backup was made and by which version; older ones do not say it.
    """

    rows: int
    tables: int
    files: int
    differences: tuple[str, ...]
    has_tables: bool
    made_at: datetime | None
    version: str

    @property
    def is_equal(self) -> bool:
        """Return whether all that the backup lists was restored."""
        return not self.differences

    @property
    def summary(self) -> str:
        """Return the result in one line."""
        return trial_summary(
            self.rows, self.tables, self.files, is_equal=self.is_equal, has_tables=self.has_tables
        )


def trial_summary(rows: int, tables: int, files: int, *, is_equal: bool, has_tables: bool) -> str:
    """Return the result of a trial in one line; the parameters are those of `Trial`."""
    result = "equal" if is_equal else "not equal"
    restored = f"{rows:,} rows in {tables:,} tables"
    if has_tables:
        return f"{restored}, {files:,} files: {result}"
    return f"{files:,} files: {result}; {restored}: not compared, an older version listed none"


def try_backup(settings: GymSettings, source: Path) -> Trial:
    """Restore a backup into a scratch place and compare it with what it lists.

    Raises
    ------
    InputError, EnvironmentLacksError : as in `restore` and `scratch_place`.
    ConflictError : as in `lock_data_folder`.
    """
    with lock_data_folder(settings.data):
        return compare_restored(settings, source)


def compare_restored(settings: GymSettings, source: Path, report: Progress = no_report) -> Trial:
    """Do what `try_backup` does; the caller holds the lock of the data folder.

    Parameters
    ----------
    report : as in `load_backup`.
    """
    with (
        scratch_place(settings) as there,
        closing(Database(there.database_url)) as database,
    ):
        if source.is_file():  # after the place of a killed trial was removed
            check_room(settings, source)
        store = open_store(there)
        contents = load_backup(there, database, store, source, report)
        found = digest_tables(database)
        files = _hashes_of_store(store)
        differences = [*_table_differences(contents.tables, found)]
        differences += _file_differences(contents.files, files)
        migrate(database)
    return Trial(
        rows=sum(one.rows for one in found.values()),
        tables=len(found),
        files=len(files),
        differences=tuple(differences[:_MAX]),
        has_tables=contents.tables is not None,
        made_at=contents.made_at,
        version=contents.version,
    )


def _hashes_of_store(store: FileStore) -> dict[str, str]:
    found = {}
    for key in store.keys(""):
        digest = hashlib.sha256()
        for piece in store.chunks(key):
            digest.update(piece)
        found[key] = digest.hexdigest()
    return found


def _table_differences(
    listed: Mapping[str, TableDigest] | None, found: Mapping[str, TableDigest]
) -> Iterator[str]:
    """Yield how the restored tables differ from the listed ones."""
    if listed is None:
        return
    for name in sorted(listed.keys() | found.keys()):
        was, now = listed.get(name), found.get(name)
        if was is None or now is None:
            yield f"table {name}: {'not listed' if was is None else 'missing'}"
        elif was.rows != now.rows:
            yield f"table {name}: {now.rows:,} rows, {was.rows:,} expected"
        elif was != now:
            yield f"table {name}: {now.rows:,} rows with other content"


def _file_differences(listed: Mapping[str, str], found: Mapping[str, str]) -> Iterator[str]:
    """Yield the first differences of the restored files from the listed ones."""
    different = (
        key for key in sorted(listed.keys() | found.keys()) if listed.get(key) != found.get(key)
    )
    for key in islice(different, _MAX):
        state = "not listed" if key not in listed else "other content"
        yield f"file {key}: {state if key in found else 'missing'}"
