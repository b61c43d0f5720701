"""A backup of a running gym: one tar file, from which another machine serves the same pages.

The database comes first, as of one moment (SQLite's online backup, or pg_dump), then the files.
Files are written before rows name them and never change, so all named files exist. Partly uploaded
photos are left out (phones ask for the offset and resume). Queued jobs stay queued, and a restored
scan resumes after its last stage.
"""

from __future__ import annotations

import io
import os
import sqlite3
import subprocess
import tarfile
import tempfile
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import IO

import msgspec
from sqlalchemy import make_url

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.outputs import Target, written_file
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.migrations.run import NEWER_HINT, migrate, revisions
from walltopo_gym.operating.backup_entries import (
    CONTENTS,
    FILES,
    TABLES,
    Contents,
    check_backup,
)
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.settings import FILE, GymSettings
from walltopo_gym.storage.files import FileStore, hash_of_file, private_folder


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
    contents = Contents({})
    own = _own_files(settings)
    target = Target(to, "FILE", "gym backup", overwrite, own, partial(_refuse_own, own))
    with (
        lock_data_folder(settings.data),
        written_file(target) as temporary,
        tempfile.TemporaryDirectory(dir=target.location.parent) as name,
        _private_file(temporary).open("wb") as out,
        tarfile.open(fileobj=out, mode="w") as tar,
    ):
        tables = Path(name) / _kind(database)
        _dump(database, tables)
        _add_file(tar, contents, tables.name, tables)
        if (settings.data / FILE).is_file():
            _add_file(tar, contents, FILE, settings.data / FILE)
        piece = Path(name) / "piece"
        for key in store.keys(""):
            try:
                store.fetch(key, piece)
            except NotFoundError:
                continue  # of a scan that was deleted meanwhile
            _add_file(tar, contents, FILES + key, piece)
        encoded = msgspec.json.encode(contents)
        entry = tarfile.TarInfo(CONTENTS)
        entry.size = len(encoded)
        tar.addfile(entry, io.BytesIO(encoded))
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

    The whole backup is checked before any of it is used.

    Raises
    ------
    InputError : no backup, a damaged one, one of the other kind of database, or the place is not
        empty.
    EnvironmentLacksError : pg_restore is missing or fails.
    """
    private_folder(settings.data)
    database = Database(settings.database_url)
    try:
        _refuse_used(database, store, settings)
        check_backup(source, _kind(database))
        with tempfile.TemporaryDirectory(dir=settings.data) as name, tarfile.open(source) as tar:
            tables = Path(name) / _kind(database)
            _write_file(_entry_content(tar, tar.getmember(tables.name)).read, tables)
            _check_tables(database, source, tables)
            number = 0
            for entry in tar:
                content = _entry_content(tar, entry)
                number += 1
                if entry.name == FILE:
                    _write_file(content.read, settings.data / FILE)
                elif entry.name.startswith(FILES):
                    piece = Path(name) / "piece"
                    _write_file(content.read, piece)
                    store.put(entry.name.removeprefix(FILES), piece)
            # The rows last: until then there is no gym.
            _load(database, tables)
        migrate(database)
    finally:
        database.close()
    return number - 1


def _entry_content(tar: tarfile.TarFile, entry: tarfile.TarInfo) -> IO[bytes]:
    content = tar.extractfile(entry)
    assert content is not None  # `check_backup` refuses all but plain files
    return content


def _check_tables(database: Database, source: Path, tables: Path) -> None:
    """Check that a file has the tables of a gym, as this kind of database writes them.

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


def _kind(database: Database) -> str:
    return TABLES["sqlite" if database.is_sqlite else "postgresql"]


def _dump(database: Database, to: Path) -> None:
    if database.is_sqlite:
        with (
            closing(sqlite3.connect(str(make_url(database.url).database))) as source,
            closing(sqlite3.connect(to)) as copy,
        ):
            source.backup(copy)
    else:
        _run_program(
            "pg_dump",
            "--format=custom",
            "--no-owner",
            f"--file={to}",
            f"--dbname={_libpq(database)}",
        )


def _load(database: Database, source: Path) -> None:
    if database.is_sqlite:
        with (
            closing(sqlite3.connect(source)) as copy,
            closing(sqlite3.connect(str(make_url(database.url).database))) as target,
        ):
            copy.backup(target)
    else:
        _run_program(
            "pg_restore",
            "--no-owner",
            "--exit-on-error",
            "--single-transaction",
            f"--dbname={_libpq(database)}",
            str(source),
        )


def _libpq(database: Database) -> str:
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


def _add_file(tar: tarfile.TarFile, contents: Contents, name: str, path: Path) -> None:
    contents.hashes[name] = hash_of_file(path)
    tar.add(path, name, recursive=False)


def _refuse_used(database: Database, store: FileStore, settings: GymSettings) -> None:
    with database.engine.connect() as connection:
        used = database.engine.dialect.has_table(connection, "people")
    if used or store.keys(""):
        raise InputError(f"{settings.data}: there is a gym already", "Restore into an empty place.")


def _write_file(read: Callable[[int], bytes], path: Path) -> None:
    with path.open("wb") as out:
        while piece := read(1 << 20):
            out.write(piece)
