"""The replacement of a gym's data by a backup: whole, in one step.

The new data are restored beside the present ones. Then a note (`switch.json`) decides for the new
ones: part by part, the present one is moved aside, and the new one takes its place. Where the parts
lie says how far it came, so a start after a kill ends it. Before the note nothing has changed; a
move that the disk refuses is taken back, with all before it.
"""

from __future__ import annotations

import logging
import os
import shutil
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Final

import msgspec
from sqlalchemy import make_url
from sqlalchemy.exc import SQLAlchemyError

from walltopo.core import EnvironmentLacksError, InputError, WalltopoError
from walltopo.core.files import read_json, write_json
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.operating.backup import Progress, load_backup, no_report
from walltopo_gym.operating.postgres_databases import (
    connected,
    count_users,
    create_database,
    drop_database,
    exchange_databases,
    has_database,
    is_postgres,
    name_beside,
    url_of,
)
from walltopo_gym.operating.restored import known_server_id, prepare_restored
from walltopo_gym.operating.scratch_place import check_room
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import open_store, private_folder
from walltopo_gym.storage.switch_note import NOTE

_LOG = logging.getLogger("walltopo_gym.operating")

NEW: Final = "restored"
_PATIENCE_S: Final = 5
_NEW_DATABASE: Final = "_walltopo_restored"
# Files and folders of the data folder that belong to the database's rows.
_PARTS: Final = (
    "gym.sqlite",
    "gym.sqlite-wal",
    "gym.sqlite-shm",
    "files",
    "incoming",
    "work",
    "editing",
)


class Switch(msgspec.Struct):
    """The content of the note.

    Parameters
    ----------
    aside : name of the folder, and ending of the name of the database, of the former data.
    parts : names of the new parts.
    database : name of the gym's database in PostgreSQL; empty: SQLite; None: a note of version
        0.1, which does not say it.
    """

    aside: str
    parts: list[str]
    database: str | None = None


def replace_data(settings: GymSettings, source: Path, report: Progress = no_report) -> list[str]:
    """Replace the data of a gym that nobody uses by those of a backup; keep `gym.toml`.

    A backup of an older version gets the tables of this one before the switch.

    Parameters
    ----------
    report : as in `load_backup`.

    Returns
    -------
    former : the folder of the former data, and the name of a former PostgreSQL database.

    Raises
    ------
    InputError : no backup, a damaged one, one of the other kind of database, or a gym whose files
        are not in its data folder.
    ConflictError : a server, a worker, or another backup, purge or restoration is at work.
    EnvironmentLacksError : as in `restore`, the disk has no room, or a part cannot be moved. If the
        note is still there, the next start goes on.
    """
    check_places(settings)
    with lock_data_folder(settings.data):
        check_unused(settings)
        with _staged_restore(settings, source, report):
            check_unused(settings)
            new = settings.data / NEW
            parts = [name for name in _PARTS if os.path.lexists(new / name)]
            aside = f"replaced-{now():%Y%m%dT%H%M%SZ}"
            switch = Switch(aside, parts, _own_database(settings))
            os.sync()
            _write_switch_note(settings, switch)
            os.sync()  # a power cut leaves no moves without their note
            _carry_out_or_undo(settings, switch)
    database = [_former_name(settings, switch.aside)] if is_postgres(settings) else []
    return [str(settings.data / switch.aside), *database]


def finish_switch(settings: GymSettings) -> bool:
    """End a switch that a kill interrupted; return whether there was one.

    Raises
    ------
    ConflictError : as in `lock_data_folder`: another process is at it; or as in `check_unused`.
    EnvironmentLacksError : a part cannot be moved, the note is damaged, or the settings name
        another database than the switch.
    """
    if not (settings.data / NOTE).is_file():
        return False
    with lock_data_folder(settings.data):
        switch = _read_switch_note(settings)
        if switch is None:
            (settings.data / NOTE).unlink()
            return False
        if switch.database not in (None, _own_database(settings)):
            raise EnvironmentLacksError(
                f"{settings.data}: half replaced, with the database {switch.database or 'SQLite'!r}"
                f" instead of {_own_database(settings) or 'SQLite'!r}",
                "Give this command the database that the server uses, by --database or gym.toml.",
            )
        check_unused(settings)
        _carry_out(settings, switch)
    return True


def _read_switch_note(settings: GymSettings) -> Switch | None:
    """Return the note; None for an empty one, from a power cut before the first move.

    Raises
    ------
    EnvironmentLacksError : it is damaged.
    """
    note = settings.data / NOTE
    if not note.read_bytes().strip(b"\0 \n"):
        return None
    try:
        return msgspec.convert(read_json(note), Switch)
    except (InputError, msgspec.ValidationError) as error:
        raise EnvironmentLacksError(
            f"{note}: damaged, so the replacement that it describes cannot go on",
            "Without a folder replaced-... from that day nothing was replaced: delete the note."
            " Otherwise move that folder's content back first.",
        ) from error


def _own_database(settings: GymSettings) -> str:
    """Return the name of the gym's database in PostgreSQL; empty: SQLite."""
    return (make_url(settings.database_url).database or "") if is_postgres(settings) else ""


def check_unused(settings: GymSettings) -> None:
    """Check that no server and no worker uses the database; those that just end get some time.

    Raises
    ------
    ConflictError : one does.
    """
    deadline = time.monotonic() + _PATIENCE_S
    while _is_used(settings):
        if time.monotonic() > deadline:
            raise ConflictError("gym-in-use", "gym-stop-first")
        time.sleep(0.1)


def _is_used(settings: GymSettings) -> bool:
    if is_postgres(settings):
        return count_users(settings) > 0
    return _is_open(settings.data / "gym.sqlite")


def _is_open(file: Path) -> bool:
    """Return whether another connection has an SQLite database open.

    Only the last one may leave the mode in which many read while one writes. Nobody serves a
    damaged file.
    """
    if not file.is_file():
        return False
    with closing(sqlite3.connect(file, timeout=0)) as connection:
        try:
            connection.execute("PRAGMA journal_mode = DELETE")
        except sqlite3.OperationalError:
            return True
        except sqlite3.DatabaseError:
            return False
    return False


def check_places(settings: GymSettings) -> None:
    """Refuse a gym whose files or SQLite database are not in its data folder.

    Raises
    ------
    InputError : it is one.
    """
    own = settings.data.absolute() / "gym.sqlite"
    database = make_url(settings.database_url).database or ""
    is_elsewhere = not is_postgres(settings) and Path(database).absolute() != own
    if settings.objects or is_elsewhere:
        raise InputError(
            "only the data of a data folder are replaced",
            "Restore into an empty place: another bucket, another database.",
        )


@contextmanager
def _staged_restore(settings: GymSettings, source: Path, report: Progress) -> Iterator[None]:
    """Restore a backup beside the present data; remove what is left of it after the block."""
    folder = settings.data / NEW
    shutil.rmtree(folder, ignore_errors=True)
    private_folder(folder)
    name = name_beside(settings, _NEW_DATABASE)
    try:
        if source.is_file():
            check_room(settings, source)
        url = ""
        if is_postgres(settings):
            with connected(settings) as connection:
                create_database(connection, name)
            url = url_of(settings, name)
        there = settings.model_copy(update={"data": folder, "database": url})
        with closing(Database(there.database_url)) as database:
            load_backup(there, database, open_store(there), source, report)
            prepare_restored(database, _present_server(settings))
        yield
    finally:
        if not (settings.data / NOTE).is_file():
            shutil.rmtree(folder, ignore_errors=True)
            if is_postgres(settings):
                with connected(settings) as connection:
                    drop_database(connection, name)


def _present_server(settings: GymSettings) -> str:
    """Return the id of the server that is replaced; empty if it has none, or cannot be read."""
    if not is_postgres(settings) and not (settings.data / "gym.sqlite").is_file():
        return ""
    try:
        with closing(Database(settings.database_url)) as database, database.reading() as session:
            return known_server_id(session)
    except SQLAlchemyError as error:
        _LOG.warning("%s: cannot be read: %s", settings.data, error)
        return ""


def _carry_out_or_undo(settings: GymSettings, switch: Switch) -> None:
    """Carry out a switch; if a part cannot be moved, restore the former state and remove the note.

    Raises
    ------
    EnvironmentLacksError, SQLAlchemyError : why it was not carried out.
    """
    try:
        _carry_out(settings, switch)
    except (OSError, SQLAlchemyError, WalltopoError):
        try:
            _move_back(settings, switch)
        except (OSError, SQLAlchemyError, WalltopoError):
            _LOG.exception("%s: the next start goes on", settings.data / NOTE)
        raise


def _carry_out(settings: GymSettings, switch: Switch) -> None:
    """Do what the note says; each step may have been done before a kill."""
    aside, new = private_folder(settings.data / switch.aside), settings.data / NEW
    for name in _PARTS:
        if name not in switch.parts or os.path.lexists(new / name):
            _move_part(settings.data / name, aside / name)
        _move_part(new / name, settings.data / name)
    _exchange_databases(settings, switch)
    os.sync()
    (settings.data / NOTE).unlink()
    shutil.rmtree(new, ignore_errors=True)


def _move_back(settings: GymSettings, switch: Switch) -> None:
    """Move all parts back, unless the databases were exchanged."""
    if is_postgres(settings) and not _has_new_database(settings):
        return
    aside, new = settings.data / switch.aside, settings.data / NEW
    for name in reversed(_PARTS):
        if name in switch.parts and not os.path.lexists(new / name):
            _move_part(settings.data / name, new / name)
        _move_part(aside / name, settings.data / name)
    os.sync()
    (settings.data / NOTE).unlink()
    with suppress(OSError):
        aside.rmdir()


def _exchange_databases(settings: GymSettings, switch: Switch) -> None:
    """Exchange PostgreSQL's databases, unless that was done."""
    if is_postgres(settings) and _has_new_database(settings):
        new = name_beside(settings, _NEW_DATABASE)
        exchange_databases(settings, new, _former_name(settings, switch.aside))


def _has_new_database(settings: GymSettings) -> bool:
    with connected(settings, "postgres") as connection:
        return has_database(connection, name_beside(settings, _NEW_DATABASE))


def _former_name(settings: GymSettings, aside: str) -> str:
    return name_beside(settings, f"_{aside}")


def _move_part(source: Path, target: Path) -> None:
    """Move a file or folder, if it is there.

    Raises
    ------
    EnvironmentLacksError : it cannot be moved, or something is in its place.
    """
    if not os.path.lexists(source):
        return
    if os.path.lexists(target):
        raise EnvironmentLacksError(
            f"{source}: its new place {target} is taken", "Move that elsewhere and start again."
        )
    try:
        source.rename(target)
    except OSError as error:
        raise EnvironmentLacksError(
            f"{source}: cannot be moved ({error.strerror})",
            "All of a data folder must be on one disk, with nothing mounted inside of it.",
        ) from error


def _write_switch_note(settings: GymSettings, switch: Switch) -> None:
    write_json(settings.data / NOTE, msgspec.to_builtins(switch))
