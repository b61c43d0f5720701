"""A backup is restored into a scratch place and compared with what the gym had."""

from __future__ import annotations

import hashlib
import io
import json
import sqlite3
import tarfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from gym.tests.worlds import Server, World
from sqlalchemy import create_engine, func, make_url, select, text

from walltopo.cli import main
from walltopo.core import EnvironmentLacksError
from walltopo_gym.accounts.models import Person
from walltopo_gym.errors import ConflictError
from walltopo_gym.operating import backup_tables
from walltopo_gym.operating.backup import back_up
from walltopo_gym.operating.backup_trial import try_backup
from walltopo_gym.operating.scratch_place import FOLDER, scratch_place
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.storage.files import hash_of_file

pytestmark = pytest.mark.both_databases("each is dumped and restored by its own programs")

Change = Callable[[str, bytes], bytes | None]


def backed_up(server: Server, to: Path) -> Path:
    services = server.services
    back_up(services.settings, services.database, services.store, to)
    return to


def command(server: Server, *words: str) -> int:
    place = ["--data", str(server.settings.data), "--database", server.settings.database_url]
    return main(["gym", *words, *place])


def changed(source: Path, to: Path, change: Change) -> Path:
    """Write a backup with other entries, whose list agrees with their hashes."""
    with tarfile.open(source) as old, tarfile.open(to, "w") as new:
        hashes: dict[str, str] = {}
        for entry in old:
            found = old.extractfile(entry)
            assert found is not None
            content = change(entry.name, found.read())
            if content is None:
                continue
            if entry.name == "contents.json":
                content = json.dumps(json.loads(content) | {"hashes": hashes}).encode()
            hashes[entry.name] = hashlib.sha256(content).hexdigest()
            entry.size = len(content)
            new.addfile(entry, io.BytesIO(content))
    return to


def relisted(change: Callable[[dict[str, Any]], object]) -> Change:
    """Return a change of the list of tables."""

    def apply(name: str, content: bytes) -> bytes:
        if name != "contents.json":
            return content
        listed = json.loads(content)
        change(listed)
        return json.dumps(listed).encode()

    return apply


def scratch_databases(server: Server) -> list[str]:
    if server.database.is_sqlite:
        return []
    like = "SELECT datname FROM pg_database WHERE datname LIKE '%scratch'"
    with server.database.reading() as session:
        return list(session.scalars(text(like)))


def nothing_is_left(server: Server) -> bool:
    return not (server.settings.data / FOLDER).exists() and not scratch_databases(server)


def test_a_backup_is_equal_to_the_gym(
    world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    server = world.server
    server.services.store.put("content/trial", b"a file of the gym")
    with server.database.reading() as session:
        people = session.scalar(select(func.count()).select_from(Person))
    assert command(server, "backup", str(tmp_path / "gym.tar"), "--try") == 0
    printed = capsys.readouterr().out
    assert " files: equal" in printed
    trial = try_backup(server.settings, tmp_path / "gym.tar")
    assert trial.summary in printed
    assert trial.is_equal
    assert trial.has_tables
    assert people is not None
    assert trial.rows > people
    assert trial.tables > 50
    assert trial.files == len(server.services.store.keys(""))
    assert nothing_is_left(server)


def test_a_row_that_comes_during_the_dump_belongs_to_no_digest(
    world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The digests and the dump are of the same moment, while the gym goes on."""
    server = world.server
    digest = backup_tables._digest_rows
    come: list[str] = []

    def slow(rows: Any) -> Any:
        if not come:
            come.append(server.person("late").email)
        return digest(rows)

    monkeypatch.setattr(backup_tables, "_digest_rows", slow)
    file = backed_up(server, tmp_path / "gym.tar")
    monkeypatch.undo()
    assert come
    assert try_backup(server.settings, file).differences == ()


def test_a_difference_is_reported(
    world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    server = world.server
    people = "people" if server.database.is_sqlite else "public.people"

    def lose(listed: dict[str, Any]) -> None:
        listed["tables"][people]["rows"] += 1
        listed["tables"]["gone"] = {"rows": 7, "digest": "00"}

    whole = backed_up(server, tmp_path / "gym.tar")
    file = changed(whole, tmp_path / "other.tar", relisted(lose))
    assert command(server, "backups", "try", str(file)) == 1
    printed = capsys.readouterr().out
    assert ": not equal" in printed
    assert "! table gone: missing" in printed
    assert f"! table {people}: " in printed

    def other(listed: dict[str, Any]) -> None:
        listed["tables"][people]["digest"] = "00"

    file = changed(whole, tmp_path / "third.tar", relisted(other))
    (difference,) = try_backup(server.settings, file).differences
    assert difference.endswith("rows with other content")
    assert nothing_is_left(server)


@pytest.mark.parametrize("server", ["sqlite"], indirect=True)
def test_a_changed_row_is_found(world: World, tmp_path: Path) -> None:
    """The file's hashes agree; the database in it is another one than was listed."""

    def rename(name: str, content: bytes) -> bytes:
        if name != "database.sqlite":
            return content
        path = tmp_path / "changed.sqlite"
        path.write_bytes(content)
        with closing(sqlite3.connect(path)) as copy:
            copy.execute("UPDATE gyms SET name = 'Other'")
            copy.commit()
            copy.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return path.read_bytes()

    whole = backed_up(world.server, tmp_path / "gym.tar")
    trial = try_backup(world.server.settings, changed(whole, tmp_path / "other.tar", rename))
    (difference,) = trial.differences
    assert difference.startswith("table gyms: ")


def test_a_backup_without_a_list_of_tables_says_so(
    world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = backed_up(world.server, tmp_path / "gym.tar")
    file = changed(whole, tmp_path / "old.tar", relisted(lambda listed: listed.pop("tables")))
    assert command(world.server, "backups", "try", str(file)) == 0
    assert "not compared, an older version listed none" in capsys.readouterr().out


def test_what_a_killed_trial_left_is_removed(world: World, tmp_path: Path) -> None:
    server = world.server
    file = backed_up(server, tmp_path / "gym.tar")
    left = server.settings.data / FOLDER
    left.mkdir()
    (left / "gym.sqlite").write_text("half")
    if not server.database.is_sqlite:
        url = make_url(server.settings.database_url)
        engine = create_engine(url, isolation_level="AUTOCOMMIT")
        with engine.connect() as connection:
            connection.execute(text(f'CREATE DATABASE "{url.database}_walltopo_scratch"'))
        engine.dispose()
    assert try_backup(server.settings, file).is_equal
    assert nothing_is_left(server)


def test_a_failed_trial_leaves_nothing(world: World, tmp_path: Path) -> None:
    server = world.server
    before = hash_of_file(backed_up(server, tmp_path / "gym.tar"))
    cut = (tmp_path / "gym.tar").read_bytes()[:9000]
    (tmp_path / "cut.tar").write_bytes(cut)
    assert command(server, "backups", "try", str(tmp_path / "cut.tar")) == 3
    assert command(server, "backups", "try", str(tmp_path / "none.tar")) == 3
    assert nothing_is_left(server)
    assert hash_of_file(tmp_path / "gym.tar") == before


def test_a_trial_needs_room(world: World, tmp_path: Path) -> None:
    server = world.server
    file = backed_up(server, tmp_path / "gym.tar")
    settings = server.settings.model_copy(update={"keep_free_mb": 10**12})
    with pytest.raises(EnvironmentLacksError, match="MB of free space"):
        try_backup(settings, file)
    assert nothing_is_left(server)


def test_one_trial_at_a_time(world: World, tmp_path: Path) -> None:
    server = world.server
    file = backed_up(server, tmp_path / "gym.tar")
    with lock_data_folder(server.settings.data), pytest.raises(ConflictError):
        try_backup(server.settings, file)


@pytest.mark.parametrize("server", ["postgresql"], indirect=True)
def test_a_role_that_may_create_no_database_is_explained(world: World) -> None:
    server = world.server
    with server.database.writing() as session:
        session.execute(text("CREATE ROLE reader LOGIN"))
    url = make_url(server.settings.database_url).set(username="reader")
    settings = server.settings.model_copy(
        update={"database": url.render_as_string(hide_password=False)}
    )
    with pytest.raises(EnvironmentLacksError, match="reader may not"), scratch_place(settings):
        pass
    assert nothing_is_left(server)
