"""The data of a gym are replaced by a backup in one step, whatever kills it."""

from __future__ import annotations

import os
import signal
import sqlite3
from collections.abc import Collection
from contextlib import closing
from itertools import count
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from gym.tests.worlds import Server, make_world, new_database
from sqlalchemy import select, text

from walltopo.cli import main
from walltopo.core import EnvironmentLacksError, InputError
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.migrations.run import migrate, revisions
from walltopo_gym.operating import backup, replacement
from walltopo_gym.operating.backup import back_up
from walltopo_gym.operating.postgres_databases import name_beside
from walltopo_gym.operating.replacement import NEW, Switch, finish_switch, replace_data
from walltopo_gym.operating.restoration import WantedRestoration, carry_out
from walltopo_gym.operating.restored import known_server_id, server_id
from walltopo_gym.operating.setup import UPLOADED
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.settings import GymSettings, load_settings
from walltopo_gym.storage.files import open_store
from walltopo_gym.storage.models import BackupRun
from walltopo_gym.storage.switch_note import NOTE

pytestmark = pytest.mark.both_databases("the switch moves files, or renames databases")


@pytest.fixture(params=["sqlite", "postgresql"])
def gym(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[GymSettings, Path]:
    """Settings of a stopped gym with later changes, and a backup from before them."""
    url = ""
    if request.param == "postgresql":
        url = new_database(request.getfixturevalue("postgres"))
    (tmp_path / "data").mkdir()
    server = Server(tmp_path / "data", url)
    world = make_world(server)
    (server.settings.data / "gym.toml").write_text("port = 8123\n")
    server.services.store.put("content/old", b"of the backup")
    back_up(server.settings, server.database, server.services.store, tmp_path / "gym.tar")
    with server.database.writing() as session:
        session.get_one(Gym, world.gym.id).name = "Later"
    server.services.store.put("content/later", b"of later")
    (server.settings.data / "gym.toml").write_text("port = 8124\n")
    server.close()
    return server.settings, tmp_path / "gym.tar"


def another_gym(settings: GymSettings, data: Path, request: pytest.FixtureRequest) -> GymSettings:
    """Return the settings of an empty gym with the same kind of database."""
    url = new_database(request.getfixturevalue("postgres")) if settings.database else ""
    data.mkdir()
    return settings.model_copy(update={"data": data, "database": url})


def state(settings: GymSettings) -> tuple[str, bool, bool]:
    """Return the gym's name, and whether the two files are there."""
    server = Server(settings.data, settings.database)
    try:
        with server.database.reading() as session:
            name = session.scalars(select(Gym.name)).one()
    finally:
        server.close()
    store = open_store(settings)
    return name, store.has("content/old"), store.has("content/later")


LATER = ("Later", True, True)


def is_restored(settings: GymSettings) -> bool:
    name, old, later = state(settings)
    return name.startswith("Gym ") and old and not later


def test_a_backup_replaces_the_data_and_they_are_put_aside(
    gym: tuple[GymSettings, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    settings, file = gym
    place = ["--data", str(settings.data), "--database", settings.database_url]
    assert main(["gym", "restore", str(file), *place]) == 3
    assert state(settings) == LATER
    assert main(["gym", "restore", str(file), "--replace", *place]) == 0
    assert is_restored(settings)
    assert (settings.data / "gym.toml").read_text() == "port = 8124\n"
    (aside,) = settings.data.glob("replaced-*")
    assert aside.name in capsys.readouterr().out.replace("\n", "")
    assert (aside / "files" / "content" / "later").read_bytes() == b"of later"
    if not settings.database:
        with closing(sqlite3.connect(aside / "gym.sqlite")) as former:
            assert former.execute("SELECT name FROM gyms").fetchall() == [("Later",)]
    assert not (settings.data / NOTE).exists()
    assert not (settings.data / NEW).exists()


# Function and number of the call, and whether the process dies before or after it.
STEPS = {
    "restored": ("_write_switch_note", 1, "before"),
    "decided": ("_write_switch_note", 1, "after"),
    "one part aside": ("_move_part", 1, "after"),
    "one part new": ("_move_part", 2, "after"),
    "all parts new": ("_exchange_databases", 1, "before"),
    "database exchanged": ("_exchange_databases", 1, "after"),
}


def replace_and_die(settings: GymSettings, file: Path, step: str) -> None:
    """Replace the data, and die by SIGKILL at a step."""
    name, number, when = STEPS[step]
    function, calls = getattr(replacement, name), count(1)

    def call(*given: Any) -> None:
        is_it = next(calls) == number
        if not (is_it and when == "before"):
            function(*given)
        if is_it:
            os.kill(os.getpid(), signal.SIGKILL)

    setattr(replacement, name, call)
    replace_data(settings, file)


def die_in_a_child(settings: GymSettings, file: Path, step: str) -> None:
    child = get_context("spawn").Process(target=replace_and_die, args=(settings, file, step))
    child.start()
    child.join()
    assert child.exitcode == -signal.SIGKILL


QUICK = ("restored", "one part aside")  # before and after the note; the others take minutes


@pytest.mark.parametrize(
    "step",
    [step if step in QUICK else pytest.param(step, marks=pytest.mark.slow) for step in STEPS],
)
def test_a_kill_leaves_the_old_or_the_new_data_whole(
    gym: tuple[GymSettings, Path], step: str
) -> None:
    settings, file = gym
    die_in_a_child(settings, file, step)
    is_decided = step != "restored"
    assert finish_switch(settings) == is_decided
    if not is_decided:
        assert state(settings) == LATER
        replace_data(settings, file)
    assert is_restored(settings)
    assert not finish_switch(settings)
    assert not (settings.data / NEW).exists()


MOVES = 14  # of seven parts, aside and in


def refuse_moves(monkeypatch: pytest.MonkeyPatch, numbers: Collection[int]) -> None:
    """Let moves fail by their number, as the disk refuses that of a mount point."""
    move, calls = replacement._move_part, count(1)

    def refuse(source: Path, target: Path) -> None:
        if next(calls) in numbers:
            raise EnvironmentLacksError(f"{source}: cannot be moved (Device or resource busy)")
        move(source, target)

    monkeypatch.setattr(replacement, "_move_part", refuse)


@pytest.mark.parametrize("number", [1, 2, 8, MOVES])
def test_a_move_that_the_disk_refuses_is_taken_back(
    gym: tuple[GymSettings, Path], number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings, file = gym
    with monkeypatch.context() as patched:
        refuse_moves(patched, {number})
        with pytest.raises(EnvironmentLacksError, match="cannot be moved"):
            replace_data(settings, file)
    assert not (settings.data / NOTE).exists()
    assert not (settings.data / NEW).exists()
    assert list(settings.data.glob("replaced-*")) == []
    assert state(settings) == LATER


def test_a_move_that_cannot_be_taken_back_is_ended_by_the_next_start(
    gym: tuple[GymSettings, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    settings, file = gym
    (settings.data / UPLOADED).write_bytes(file.read_bytes())
    with monkeypatch.context() as patched:
        refuse_moves(patched, range(8, 12))
        with pytest.raises(EnvironmentLacksError, match="cannot be moved"):
            carry_out(settings, WantedRestoration(UPLOADED, None))
    # Nothing made an empty database in the place of the former one, and nothing serves a half.
    assert (settings.data / NOTE).exists()
    with pytest.raises(EnvironmentLacksError, match="half replaced"):
        state(settings)
    assert finish_switch(settings)
    assert is_restored(settings)
    (aside,) = settings.data.glob("replaced-*")
    assert (aside / "files" / "content" / "later").read_bytes() == b"of later"


def test_what_lies_in_a_parts_place_is_kept(gym: tuple[GymSettings, Path]) -> None:
    settings, _ = gym
    aside, new = settings.data / "replaced-before", settings.data / NEW
    for folder in (aside, new):
        (folder / "files").mkdir(parents=True)
        (folder / "files" / "mine").write_bytes(b"mine")
    replacement._write_switch_note(settings, Switch(aside.name, ["files"]))
    with pytest.raises(EnvironmentLacksError, match="is taken"):
        finish_switch(settings)
    assert (aside / "files" / "mine").read_bytes() == b"mine"
    assert (settings.data / "files" / "content" / "later").read_bytes() == b"of later"


def test_a_switch_waits_until_nobody_uses_the_gym(gym: tuple[GymSettings, Path]) -> None:
    settings, _ = gym
    server = Server(settings.data, settings.database)
    with server.database.reading() as session:
        session.scalars(select(Gym.name)).one()
    replacement._write_switch_note(settings, Switch("replaced-now", []))
    with pytest.raises(ConflictError, match="uses this gym"):
        finish_switch(settings)
    server.close()
    (settings.data / NOTE).unlink()
    assert state(settings) == LATER


def test_a_damaged_database_is_replaced(gym: tuple[GymSettings, Path]) -> None:
    settings, file = gym
    if settings.database:
        pytest.skip("PostgreSQL watches its own files")
    (settings.data / "gym.sqlite").write_bytes(b"no database at all" * 1000)
    replace_data(settings, file)
    assert is_restored(settings)


def test_an_error_of_sqlite_itself_leaves_the_data_and_is_the_result(
    gym: tuple[GymSettings, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    settings, file = gym

    def fail(*_: object) -> None:
        raise sqlite3.OperationalError("disk I/O error")

    monkeypatch.setattr(backup, "load_tables", fail)
    (settings.data / UPLOADED).write_bytes(file.read_bytes())
    server = Server(settings.data, settings.database)
    operator = server.person("operator").id
    server.close()
    carry_out(settings, WantedRestoration(UPLOADED, operator))
    assert state(settings) == LATER
    with closing(Database(settings.database_url)) as database, database.reading() as session:
        run = session.scalars(select(BackupRun).where(BackupRun.kind == "restore")).one()
        entry = session.scalars(
            select(AuditEntry).where(AuditEntry.action == "backup.restore")
        ).one()
    assert (run.state, "disk I/O error" in run.error) == ("failed", True)
    assert entry.person_id == operator


def test_a_gym_replaced_in_place_stays_the_same_server(gym: tuple[GymSettings, Path]) -> None:
    settings, file = gym
    with closing(Database(settings.database_url)) as database:
        first = server_id(database)
        assert server_id(database) == first
    replace_data(settings, file)
    with closing(Database(settings.database_url)) as database:
        assert server_id(database) == first


def test_a_copy_of_a_gym_is_another_server(
    tmp_path: Path, gym: tuple[GymSettings, Path], request: pytest.FixtureRequest
) -> None:
    settings, _ = gym
    with closing(Database(settings.database_url)) as database:
        first = server_id(database)
        back_up(settings, database, open_store(settings), tmp_path / "known.tar")
    copied = another_gym(settings, tmp_path / "copied", request)
    replace_data(copied, tmp_path / "known.tar")
    with closing(Database(copied.database_url)) as database:
        with database.reading() as session:
            assert known_server_id(session) == ""
        assert server_id(database) != first


def test_a_command_with_another_database_ends_no_switch(
    tmp_path: Path, gym: tuple[GymSettings, Path], request: pytest.FixtureRequest
) -> None:
    settings, file = gym
    die_in_a_child(settings, file, "decided")
    other = "" if settings.database else new_database(request.getfixturevalue("postgres"))
    wrong = settings.model_copy(update={"database": other})
    with pytest.raises(EnvironmentLacksError, match="instead of"):
        finish_switch(wrong)
    assert finish_switch(settings)
    assert is_restored(settings)


def test_an_empty_note_of_a_power_cut_replaces_nothing(gym: tuple[GymSettings, Path]) -> None:
    settings, _ = gym
    (settings.data / NOTE).touch()
    assert not finish_switch(settings)
    assert state(settings) == LATER


def test_a_damaged_note_says_what_to_do(gym: tuple[GymSettings, Path]) -> None:
    settings, _ = gym
    (settings.data / NOTE).write_text('{"aside": "rep')
    with pytest.raises(EnvironmentLacksError, match="damaged") as caught:
        finish_switch(settings)
    assert "delete the note" in str(caught.value.hint)
    assert (settings.data / NOTE).exists()


def test_an_older_backup_gets_the_tables_of_this_version(
    tmp_path: Path, gym: tuple[GymSettings, Path], request: pytest.FixtureRequest
) -> None:
    settings, _ = gym
    older = another_gym(settings, tmp_path / "older", request)
    with closing(Database(older.database_url)) as database:
        migrate(database, revisions()[-2])
        back_up(older, database, open_store(older), tmp_path / "older.tar")
    replace_data(settings, tmp_path / "older.tar")
    with closing(Database(settings.database_url)) as database, database.reading() as session:
        assert session.scalar(text("SELECT version_num FROM alembic_version")) == revisions()[-1]


def test_a_gym_in_use_is_not_replaced(gym: tuple[GymSettings, Path]) -> None:
    settings, file = gym
    server = Server(settings.data, settings.database)
    with server.database.reading() as session:
        session.scalars(select(Gym.name)).one()
    with pytest.raises(ConflictError, match="uses this gym"):
        replace_data(settings, file)
    server.close()
    assert state(settings) == LATER


def test_a_damaged_backup_replaces_nothing(gym: tuple[GymSettings, Path], tmp_path: Path) -> None:
    settings, file = gym
    (tmp_path / "cut.tar").write_bytes(file.read_bytes()[:9000])
    with pytest.raises(InputError, match="backup"):
        replace_data(settings, tmp_path / "cut.tar")
    full = settings.model_copy(update={"keep_free_mb": 10**12})
    with pytest.raises(EnvironmentLacksError, match="free space"):
        replace_data(full, file)
    elsewhere = settings.model_copy(update={"objects": "s3://walls"})
    with pytest.raises(InputError, match="empty place"):
        replace_data(elsewhere, file)
    assert state(settings) == LATER
    assert not (settings.data / NEW).exists()
    assert list(settings.data.glob("replaced-*")) == []


def test_a_backup_of_a_newer_version_replaces_nothing(
    tmp_path: Path, gym: tuple[GymSettings, Path], request: pytest.FixtureRequest
) -> None:
    settings, _ = gym
    newer = another_gym(settings, tmp_path / "newer", request)
    with closing(Database(newer.database_url)) as database:
        migrate(database)
        with database.writing() as session:
            session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
        back_up(newer, database, open_store(newer), tmp_path / "newer.tar")
    with pytest.raises(EnvironmentLacksError, match="newer version"):
        replace_data(settings, tmp_path / "newer.tar")
    assert state(settings) == LATER
    assert not (settings.data / NEW).exists()


def test_of_two_at_once_one_replaces_the_data(gym: tuple[GymSettings, Path]) -> None:
    settings, file = gym
    with lock_data_folder(settings.data), pytest.raises(ConflictError):
        replace_data(settings, file)
    assert state(settings) == LATER


def test_the_name_of_a_database_beside_the_gyms_own_fits_in_postgresql(tmp_path: Path) -> None:
    url = "postgresql+psycopg://localhost/" + "ü" * 31
    settings = load_settings({"data": tmp_path, "database": url}, {})
    name = name_beside(settings, "_walltopo_restored")
    assert name == "ü" * 22 + "_walltopo_restored"
    assert len(name.encode()) <= 63
