"""A backup of a gym restores to the same pages elsewhere; what is damaged is refused whole."""

from __future__ import annotations

import gzip
import stat
import tarfile
from pathlib import Path
from typing import Any

import pytest
from gym.tests.hurried import waiting
from gym.tests.worlds import Server, World, hold, new_database
from sqlalchemy import select, text

from walltopo.core import EnvironmentLacksError, InputError
from walltopo_gym.errors import ConflictError
from walltopo_gym.operating.backup import back_up, restore
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State
from walltopo_gym.server.app import PREFIX
from walltopo_gym.settings import GymSettings, load_settings
from walltopo_gym.storage.files import open_store


def elsewhere(world: World, request: pytest.FixtureRequest, folder: Path) -> GymSettings:
    """Settings of another machine with the same kind of database."""
    url = ""
    if world.server.settings.database:
        url = new_database(request.getfixturevalue("postgres"))
    return load_settings({"data": folder, "database": url}, {})


def backed_up(world: World, to: Path) -> Path:
    services = world.server.services
    assert back_up(services.settings, services.database, services.store, to) > 0
    return to


def pages(server: Server, world: World) -> list[Any]:
    """Return what a member sees: the wall, and the bytes of its files."""
    member = world.people["member"]
    path = f"{world.path}/walls/{world.wall.id}/published"
    answer = server.ask("GET", path, member).json()
    files = [
        server.ask("GET", file.removeprefix(PREFIX), member) for file in answer["files"].values()
    ]
    assert all(file.status_code == 200 for file in files)
    return [answer, *(file.content for file in files)]


def test_it_restores_to_the_same_pages(
    world: World, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    queued = world.scan(usable=3)
    start = f"{world.path}/scans/{queued}/start"
    assert world.server.ask("POST", start, world.people["setter"]).is_success
    before = pages(world.server, world)
    file = backed_up(world, tmp_path / "gym.tar")
    there = elsewhere(world, request, tmp_path / "there")
    restore(there, open_store(there), file)
    other = Server(there.data, there.database)
    assert pages(other, world) == before
    with other.database.reading() as session:
        state, run = session.execute(select(Scan.state, Scan.run).where(Scan.id == queued)).one()
    assert (state, run) == (State.QUEUED, 1)
    assert (str(queued), 1) in waiting(other, "scans")
    with pytest.raises(InputError, match="already"):
        restore(there, open_store(there), file)
    other.close()


def test_a_damaged_backup_is_refused_before_anything_is_used(
    world: World, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    world.server.services.store.put("content/damage", b"a file of the gym")
    whole = backed_up(world, tmp_path / "whole.tar").read_bytes()
    there = elsewhere(world, request, tmp_path / "there")
    damage = {
        "flipped": whole.replace(b"a file of the gym", b"a file of the gim"),
        "cut": whole[: len(whole) // 2],
        "other": b"no tar at all",
    }
    for name, content in damage.items():
        file = tmp_path / f"{name}.tar"
        file.write_bytes(content)
        with pytest.raises(InputError, match="backup"):
            restore(there, open_store(there), file)
    with tarfile.open(tmp_path / "out.tar", "w") as tar:
        tar.add(tmp_path / "cut.tar", "../out")
    with pytest.raises(InputError, match="belongs"):
        restore(there, open_store(there), tmp_path / "out.tar")
    assert open_store(there).keys("") == []


def _stamp(path: Path) -> tuple[int, int, int] | None:
    """Return what changes with a file. Its content is not read: to close a file ends all locks that
    this process has on it, SQLite's too, and the database is open."""
    if not path.is_file():
        return None
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def test_a_backup_of_a_newer_version_is_refused_before_anything_is_used(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    old = Server(tmp_path / "old")
    old.services.store.put("content/abcd", b"x")
    with old.database.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    services = old.services
    back_up(services.settings, services.database, services.store, tmp_path / "gym.tar")
    old.close()
    settings = load_settings({"data": tmp_path / "new"}, {})
    for _ in range(2):  # and the place stays empty
        with pytest.raises(EnvironmentLacksError, match="newer version"):
            restore(settings, open_store(settings), tmp_path / "gym.tar")
    assert not (tmp_path / "new" / "gym.sqlite").exists() or not open_store(settings).keys("")


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_backup_replaces_nothing_of_the_gym(
    world: World, tmp_path: Path, *, overwrite: bool
) -> None:
    services = world.server.services
    place = services.settings, services.database, services.store
    data = services.settings.data
    link = tmp_path / "link.tar"
    link.symlink_to(data / "gym.sqlite")
    (tmp_path / "folder").mkdir()
    for to in (data / "gym.sqlite", data / "files" / "new.tar", data, link, tmp_path / "folder"):
        before = _stamp(to)
        with pytest.raises(InputError):
            back_up(*place, to, overwrite=overwrite)
        assert _stamp(to) == before
    assert not (data / "files" / "new.tar").exists()


def test_a_backup_replaces_another_file_only_when_that_is_wished(
    world: World, tmp_path: Path
) -> None:
    services = world.server.services
    place = services.settings, services.database, services.store
    other = tmp_path / "letter.txt"
    other.write_text("mine")
    with pytest.raises(InputError, match="already"):
        back_up(*place, other)
    assert other.read_text() == "mine"
    back_up(*place, other, overwrite=True)
    assert tarfile.is_tarfile(other)
    assert stat.S_IMODE(other.stat().st_mode) == 0o600
    assert sorted(path.name for path in tmp_path.iterdir()) == ["letter.txt"]


def test_a_database_elsewhere_is_not_replaced_by_its_backup(world: World, tmp_path: Path) -> None:
    services = world.server.services
    elsewhere = tmp_path / "walls.sqlite"
    elsewhere.write_text("rows")
    settings = load_settings({"data": tmp_path / "data", "database": f"sqlite:///{elsewhere}"}, {})
    with pytest.raises(InputError):
        back_up(settings, services.database, services.store, elsewhere, overwrite=True)
    assert elsewhere.read_text() == "rows"


def test_one_at_a_time(world: World, tmp_path: Path) -> None:
    with lock_data_folder(world.server.settings.data), pytest.raises(ConflictError):
        backed_up(world, tmp_path / "gym.tar")
    assert not (tmp_path / "gym.tar").exists()


def test_settings_behind_a_link_are_backed_up(tmp_path: Path) -> None:
    """Deployments link `gym.toml` to a file that they manage."""
    managed = tmp_path / "managed.toml"
    managed.write_text("port = 8123\n")
    (tmp_path / "data").mkdir()
    server = Server(tmp_path / "data")
    (server.settings.data / "gym.toml").symlink_to(managed)
    back_up(server.settings, server.database, server.services.store, tmp_path / "gym.tar")
    server.close()
    there = load_settings({"data": tmp_path / "new"}, {})
    restore(there, open_store(there), tmp_path / "gym.tar")
    assert (tmp_path / "new" / "gym.toml").read_text() == managed.read_text()


def test_a_compressed_file_is_no_backup(world: World, tmp_path: Path) -> None:
    """It could expand beyond any limit."""
    plain = backed_up(world, tmp_path / "gym.tar")
    packed = tmp_path / "gym.tar.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes(), 1))
    there = load_settings({"data": tmp_path / "new"}, {})
    with pytest.raises(InputError, match="cannot be read as a backup"):
        restore(there, open_store(there), packed)
