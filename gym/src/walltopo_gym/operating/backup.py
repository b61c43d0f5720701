"""A backup of a running gym: one tar file, from which another machine serves the same pages.

The database comes first, as of one moment (SQLite's online backup, or pg_dump), then the files.
Files are written before rows name them and never change, so all named files exist. Partly uploaded
photos are left out (phones ask for the offset and resume). Queued jobs stay queued, and a restored
scan resumes after its last stage.
"""

from __future__ import annotations

import hashlib
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
from typing import IO, Final

import msgspec
from sqlalchemy import make_url

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.outputs import Target, written_file
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.migrations.run import migrate
from walltopo_gym.operating.upkeep import alone
from walltopo_gym.settings import FILE, GymSettings
from walltopo_gym.storage.files import FileStore, hash_of_file, private_folder

_TABLES: Final = {"sqlite": "database.sqlite", "postgresql": "database.pgdump"}
_FILES: Final = "files/"
_CONTENTS: Final = "contents.json"  # the last entry: a backup that was cut off has none


class _Contents(msgspec.Struct):
    """Contents of a backup: name to SHA-256."""

    hashes: dict[str, str]


def back_up(
    settings: GymSettings, database: Database, store: FileStore, to: Path, *,
    overwrite: bool = False,
) -> int:  # fmt: skip
    """Write a backup to `to`, whole or not at all; return its number of files.

    Only its owner can read it, because it holds personal data.

    Parameters
    ----------
    overwrite : another file may be replaced; never one of the gym's own.

    Raises
    ------
    InputError : an existing file would be replaced, or `to` lies in the data folder.
    EnvironmentLacksError : pg_dump is missing or fails; ConflictError : as in `alone`.
    """
    contents = _Contents({})
    own = _own_files(settings)
    target = Target(to, "FILE", "gym backup", overwrite, own, partial(_refuse_own, own))
    with (
        alone(settings.data),
        written_file(target) as temporary,
        tempfile.TemporaryDirectory(dir=target.place.parent) as name,
        _private(temporary).open("wb") as out,
        tarfile.open(fileobj=out, mode="w") as tar,
    ):
        tables = Path(name) / _kind(database)
        _dump(database, tables)
        _add(tar, contents, tables.name, tables)
        if (settings.data / FILE).is_file():
            _add(tar, contents, FILE, settings.data / FILE)
        piece = Path(name) / "piece"
        for key in store.keys(""):
            try:
                store.fetch(key, piece)
            except NotFoundError:
                continue  # of a scan that was deleted meanwhile
            _add(tar, contents, _FILES + key, piece)
        encoded = msgspec.json.encode(contents)
        entry = tarfile.TarInfo(_CONTENTS)
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


def _refuse_own(own: Sequence[Path], place: Path) -> None:
    """Refuse a path among the gym's own files.

    Raises
    ------
    InputError : it is one.
    """
    if any(place.is_relative_to(os.path.realpath(path)) for path in own):
        raise InputError(
            f"{place}: belongs to the gym itself", "Write the backup outside of its data folder."
        )


def _private(path: Path) -> Path:
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
        _check(source, _kind(database))
        with tempfile.TemporaryDirectory(dir=settings.data) as name, tarfile.open(source) as tar:
            tables = Path(name) / _kind(database)
            number = 0
            for entry in tar:
                content = tar.extractfile(entry)
                assert content is not None
                number += 1
                if entry.name == tables.name:
                    _write(content.read, tables)
                elif entry.name == FILE:
                    _write(content.read, settings.data / FILE)
                elif entry.name.startswith(_FILES):
                    piece = Path(name) / "piece"
                    _write(content.read, piece)
                    store.put(entry.name.removeprefix(_FILES), piece)
            # The rows last: until then there is no gym.
            _load(database, tables)
        migrate(database)
    finally:
        database.close()
    return number - 1


def _kind(database: Database) -> str:
    return _TABLES["sqlite" if database.is_sqlite else "postgresql"]


def _dump(database: Database, to: Path) -> None:
    if database.is_sqlite:
        with (
            closing(sqlite3.connect(str(make_url(database.url).database))) as source,
            closing(sqlite3.connect(to)) as copy,
        ):
            source.backup(copy)
    else:
        _run("pg_dump", "--format=custom", "--no-owner", f"--file={to}",
             f"--dbname={_libpq(database)}")  # fmt: skip


def _load(database: Database, source: Path) -> None:
    if database.is_sqlite:
        with (
            closing(sqlite3.connect(source)) as copy,
            closing(sqlite3.connect(str(make_url(database.url).database))) as target,
        ):
            copy.backup(target)
    else:
        _run("pg_restore", "--no-owner", "--exit-on-error", "--single-transaction",
             f"--dbname={_libpq(database)}", str(source))  # fmt: skip


def _libpq(database: Database) -> str:
    url = make_url(database.url).set(drivername="postgresql")
    return url.render_as_string(hide_password=False)


def _run(program: str, *words: str) -> None:
    try:
        ended = subprocess.run([program, *words], capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise EnvironmentLacksError(
            f"{program} is not here", "Install PostgreSQL's client programs."
        ) from error
    if ended.returncode:
        raise EnvironmentLacksError(f"{program} failed: {ended.stderr.strip()[-500:]}")


def _add(tar: tarfile.TarFile, contents: _Contents, name: str, path: Path) -> None:
    contents.hashes[name] = hash_of_file(path)
    tar.add(path, name, recursive=False)


def _refuse_used(database: Database, store: FileStore, settings: GymSettings) -> None:
    with database.engine.connect() as connection:
        used = database.engine.dialect.has_table(connection, "people")
    if used or store.keys(""):
        raise InputError(f"{settings.data}: there is a gym already", "Restore into an empty place.")


def _check(source: Path, tables: str) -> None:
    """Check that a backup is whole and of this kind of database."""
    hashes: dict[str, str] = {}
    listed: _Contents | None = None
    try:
        with tarfile.open(source) as tar:
            for entry in tar:
                content = tar.extractfile(entry) if entry.isfile() else None
                if content is None or entry.name.startswith(("/", "..")) or "/../" in entry.name:
                    raise InputError(f"{source}: {entry.name!r} belongs in no backup")
                if entry.name == _CONTENTS:
                    listed = msgspec.json.decode(content.read(), type=_Contents)
                else:
                    hashes[entry.name] = _hash(content)
    except (OSError, tarfile.TarError, msgspec.MsgspecError) as error:
        raise InputError(f"{source}: cannot be read as a backup ({error})") from error
    if listed is None or listed.hashes != hashes:
        raise InputError(f"{source}: this backup is damaged or was cut off", "Take another one.")
    if tables not in hashes:
        kind = "PostgreSQL" if _TABLES["postgresql"] in hashes else "SQLite"
        raise InputError(f"{source}: a backup of {kind}", f"Restore it into {kind}.")


def _hash(content: IO[bytes]) -> str:
    digest = hashlib.sha256()
    while piece := content.read(1 << 20):
        digest.update(piece)
    return digest.hexdigest()


def _write(read: Callable[[int], bytes], path: Path) -> None:
    with path.open("wb") as out:
        while piece := read(1 << 20):
            out.write(piece)
