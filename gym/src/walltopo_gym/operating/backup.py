"""A backup of a running gym: one tar file, from which another machine serves the same pages.

The database comes first, as of one moment (SQLite's online backup, or pg_dump), then the files.
Files are written before rows name them and never change, so all named files exist. Partly uploaded
photos are left out (phones ask for the offset and resume). Queued jobs stay queued, and a restored
scan resumes after its last stage.
"""

from __future__ import annotations

import io
import os
import tarfile
import tempfile
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import IO

import msgspec
from sqlalchemy import make_url

from walltopo.core import InputError
from walltopo.core.outputs import Target, written_file
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.operating.backup_entries import CONTENTS, FILES, Contents, check_backup
from walltopo_gym.operating.backup_tables import (
    check_tables,
    dump_tables,
    load_tables,
    tables_entry,
)
from walltopo_gym.operating.restored import prepare_restored
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.settings import FILE, GymSettings
from walltopo_gym.storage.files import FileStore, hash_of_file, private_folder

Progress = Callable[[int, int], None]


def no_report(done: int, total: int) -> None:
    """Report no progress."""


def back_up(
    settings: GymSettings,
    database: Database,
    store: FileStore,
    to: Path,
    *,
    overwrite: bool = False,
) -> int:
    """Write a backup to `to`, whole or not at all; return its number of files.

    Only its owner can read it, because it holds personal data.

    Parameters
    ----------
    overwrite : another file may be replaced; never one of the gym's own.

    Raises
    ------
    InputError : an existing file would be replaced, or `to` lies in the data folder.
    EnvironmentLacksError : pg_dump is missing or fails; ConflictError : as in `lock_data_folder`.
    """
    own = _own_files(settings)
    target = Target(to, "FILE", "gym backup", overwrite, own, partial(_refuse_own, own))
    with lock_data_folder(settings.data), written_file(target) as temporary:
        return write_backup(settings, database, store, temporary)


def write_backup(
    settings: GymSettings,
    database: Database,
    store: FileStore,
    to: Path,
    report: Progress = no_report,
) -> int:
    """Write a backup to a new file; return its number of files.

    The caller holds the lock of the data folder. A killed process leaves a part of the file.

    Parameters
    ----------
    report : receives the number of written files and of all files, and may raise.

    Raises
    ------
    EnvironmentLacksError : as in `back_up`.
    """
    contents = Contents({}, made_at=now(), version=version("walltopo-gym"))
    with (
        tempfile.TemporaryDirectory(dir=to.parent) as name,
        _private_file(to).open("wb") as out,
        tarfile.open(fileobj=out, mode="w", dereference=True) as tar,
    ):
        tables = Path(name) / tables_entry(database)
        contents.tables = dump_tables(database, tables)
        _add_file(tar, contents, tables.name, tables)
        if (settings.data / FILE).is_file():
            _add_file(tar, contents, FILE, settings.data / FILE)
        piece = Path(name) / "piece"
        keys = store.keys("")
        for done, key in enumerate(keys):
            report(done, len(keys))
            try:
                store.fetch(key, piece)
            except NotFoundError:
                continue  # of a scan that was deleted meanwhile
            _add_file(tar, contents, FILES + key, piece)
        _add_contents(tar, contents)
    return len(contents.hashes)


def _own_files(settings: GymSettings) -> list[Path]:
    """Return the files and folders of a gym."""
    own = [settings.data]
    url = make_url(settings.database_url)
    if url.get_backend_name() == "sqlite" and url.database:
        own += [Path(url.database + end) for end in ("", "-wal", "-shm")]
    if settings.objects.startswith("file://"):
        own.append(Path(settings.objects.removeprefix("file://")))
    return own


def _refuse_own(own: Sequence[Path], backup: Path) -> None:
    """Refuse a path among the gym's own files.

    Raises
    ------
    InputError : it is one.
    """
    if any(backup.is_relative_to(os.path.realpath(path)) for path in own):
        raise InputError(
            f"{backup}: belongs to the gym itself", "Write the backup outside of its data folder."
        )


def _private_file(path: Path) -> Path:
    """Return the path of a new file that only its owner can read."""
    path.touch(mode=0o600, exist_ok=False)
    return path


def restore(settings: GymSettings, store: FileStore, source: Path) -> int:
    """Restore a backup into an empty data folder and database; return its number of files.

    The whole backup is checked before any of it is used. One of an older version gets the tables of
    this one.

    Raises
    ------
    InputError : no backup, a damaged one, one of the other kind of database, or the place is not
        empty.
    EnvironmentLacksError : pg_restore is missing or fails.
    """
    with closing(Database(settings.database_url)) as database:
        contents = load_backup(settings, database, store, source)
        prepare_restored(database)
    return len(contents.hashes)


def load_backup(
    settings: GymSettings,
    database: Database,
    store: FileStore,
    source: Path,
    report: Progress = no_report,
) -> Contents:
    """Fill an empty data folder and database from a backup, with the tables of its version.

    Parameters
    ----------
    report : receives the number of restored files and of all files, and may raise.

    Returns
    -------
    contents : what the backup says that it has.

    Raises
    ------
    InputError, EnvironmentLacksError : as in `restore`.
    """
    private_folder(settings.data)
    _refuse_used(database, store, settings)
    contents = check_backup(source, tables_entry(database))
    with tempfile.TemporaryDirectory(dir=settings.data) as name, tarfile.open(source, "r:") as tar:
        tables = Path(name) / tables_entry(database)
        _write_file(_entry_content(tar, tar.getmember(tables.name)).read, tables)
        check_tables(database, source, tables)
        for done, entry in enumerate(tar):
            report(done, len(contents.hashes))
            content = _entry_content(tar, entry)
            if entry.name == FILE:
                _write_file(content.read, settings.data / FILE)
            elif entry.name.startswith(FILES):
                piece = Path(name) / "piece"
                _write_file(content.read, piece)
                store.put(entry.name.removeprefix(FILES), piece)
        # The rows last: until then there is no gym.
        load_tables(database, tables)
    return contents


def _entry_content(tar: tarfile.TarFile, entry: tarfile.TarInfo) -> IO[bytes]:
    content = tar.extractfile(entry)
    assert content is not None  # `check_backup` refuses all but plain files
    return content


def _add_file(tar: tarfile.TarFile, contents: Contents, name: str, path: Path) -> None:
    contents.hashes[name] = hash_of_file(path)
    tar.add(path, name, recursive=False)


def _add_contents(tar: tarfile.TarFile, contents: Contents) -> None:
    encoded = msgspec.json.encode(contents)
    entry = tarfile.TarInfo(CONTENTS)
    entry.size = len(encoded)
    tar.addfile(entry, io.BytesIO(encoded))


def _refuse_used(database: Database, store: FileStore, settings: GymSettings) -> None:
    with database.engine.connect() as connection:
        used = database.engine.dialect.has_table(connection, "people")
    if used or store.keys(""):
        raise InputError(f"{settings.data}: there is a gym already", "Restore into an empty place.")


def _write_file(read: Callable[[int], bytes], path: Path) -> None:
    with path.open("wb") as out:
        while piece := read(1 << 20):
            out.write(piece)
