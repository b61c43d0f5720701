"""A full disk: commands and API say so and what to do, and a purge makes room."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from gym.tests.operating.test_gym_operator import age
from gym.tests.worlds import Server, World, make_world
from obstore.exceptions import GenericError
from sqlalchemy import event, update
from sqlalchemy.exc import DatabaseError, OperationalError

from walltopo.cli import main
from walltopo_gym.accounts.models import SignIn
from walltopo_gym.clock import now
from walltopo_gym.database.errors import explain_error
from walltopo_gym.operating import backup
from walltopo_gym.operating.purge import purge


@pytest.fixture
def lone(tmp_path: Path) -> Iterator[World]:
    """A gym in SQLite with a database of its own, which becomes full."""
    (tmp_path / "data").mkdir()
    server = Server(tmp_path / "data")
    yield make_world(server)
    server.close()


@contextmanager
def full(server: Server) -> Iterator[None]:
    """Let the database grow no further, as on a full disk."""

    def bound(connection: Any, record: object) -> None:
        pages = connection.execute("PRAGMA page_count").fetchone()[0]
        connection.execute(f"PRAGMA max_page_count = {pages}")

    server.database.engine.dispose()
    event.listen(server.database.engine, "connect", bound)
    try:
        yield
    finally:
        event.remove(server.database.engine, "connect", bound)
        server.database.engine.dispose()


@pytest.mark.slow
def test_a_write_on_a_full_disk_is_refused_in_words(lone: World) -> None:
    with full(lone.server):
        answers = [
            lone.server.ask("POST", f"{lone.path}/walls", lone.owner, {"name": f"{n:080}"})
            for n in range(300)
        ]
        refused = next(answer for answer in answers if not answer.is_success)
        assert (refused.status_code, refused.json()["code"]) == (507, "disk-is-full")
        assert lone.server.ask("GET", f"{lone.path}/walls", lone.owner).is_success


def place(server: Server) -> list[str]:
    return ["--data", str(server.settings.data), "--database", server.settings.database_url]


@pytest.mark.parametrize(
    "error",
    [
        OSError(28, "No space left on device"),
        sqlite3.OperationalError("database or disk is full"),
        OperationalError("INSERT", {}, sqlite3.OperationalError("database or disk is full")),
        OperationalError("INSERT", {}, Exception("could not extend file: No space left")),
        GenericError("Generic LocalFileSystem error: No space left on device (os error 28)"),
    ],
    ids=["os", "sqlite", "sqlalchemy", "postgresql", "store"],
)
def test_a_backup_to_a_full_disk_says_so(
    lone: World,
    tmp_path: Path,
    error: Exception,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(backup, "dump_tables", fail)
    target = tmp_path / "out" / "gym.tar"
    target.parent.mkdir()
    assert main(["gym", "backup", str(target), *place(lone.server)]) == 5
    shown = capsys.readouterr().err
    assert "the disk is full" in shown or "no space left while writing" in shown
    assert "disk space" in shown
    assert os.listdir(target.parent) == []


def test_a_purge_makes_room_first_and_then_deletes_rows(lone: World) -> None:
    server, store = lone.server, lone.server.services.store
    store.put("content/ffff", b"x" * 1000)
    age(server, "content/ffff")
    with server.database.writing() as session:
        session.execute(update(SignIn).values(expires_at=now() - timedelta(days=1)))

    class Full(type(server.database)):  # type: ignore[misc]
        """Refuses to write until the file is gone."""

        def writing(self) -> Any:
            if store.has("content/ffff"):
                raise sqlite3.OperationalError("database or disk is full")
            return super().writing()

    gone = purge(server.settings, Full(server.database.url), store)
    assert (gone.files, gone.rows > 0) == (["content/ffff"], True)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("attempt to write a readonly database", "database-read-only"),
        ("database disk image is malformed", "database-damaged"),
        ("file is not a database", "database-damaged"),
        ("database is locked", "database-away"),
        ("the database system is starting up", "database-away"),
    ],
)
def test_each_kind_of_database_error_has_its_own_code(words: str, code: str) -> None:
    found = explain_error(DatabaseError("SELECT 1", {}, sqlite3.DatabaseError(words)))
    assert found is not None
    assert found.key == code
    assert explain_error(ValueError(words)) is None
