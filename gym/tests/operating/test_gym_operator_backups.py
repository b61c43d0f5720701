"""The operator's page of backups: listed, made, tried again and downloaded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from gym.tests.hurried import do_all, forget_jobs
from gym.tests.operating.test_gym_operator_access import code, confirmed_before
from gym.tests.operating.test_gym_operator_page import logged, read
from gym.tests.worlds import Outbox, Server, Somebody, World
from sqlalchemy import delete

from walltopo_gym.jobs.queue import Task
from walltopo_gym.jobs.worker_slot import WorkerSlot
from walltopo_gym.operating.backup_runs import BACKUPS, BackupRuns, record_failure
from walltopo_gym.operating.backup_target import open_target
from walltopo_gym.operating.restoration import Restoration
from walltopo_gym.storage.models import BackupRun


@pytest.fixture
def folder(server: Server, tmp_path: Path) -> Iterator[Path]:
    """The folder to which the backups of the server go."""
    forget_jobs(server)
    with server.database.writing() as session:
        session.execute(delete(BackupRun))
    made = tmp_path / "backups"
    made.mkdir()
    before = server.services
    settings = before.settings.model_copy(update={"backup_to": str(made)})
    parts = {**before.parts, Restoration: Restoration()}
    server.app.state.services = replace(before, settings=settings, parts=parts)
    yield made
    server.app.state.services = before


@pytest.fixture
def operator(server: Server) -> Somebody:
    return server.person("operator")


def work(server: Server) -> BackupRuns:
    """Carry out what is queued."""
    services = server.app.state.services
    runs = BackupRuns(services.settings, services.database, services.store, Outbox())
    do_all(server, Task(BACKUPS, runs.run, record_failure))
    return runs


def page(server: Server, operator: Somebody) -> Any:
    return read(server, "backups", operator)


@pytest.mark.both_databases("a trial needs a scratch database")
def test_an_operator_makes_tries_and_downloads_a_backup(
    world: World, folder: Path, operator: Somebody
) -> None:
    server = world.server
    assert page(server, operator)["backups"] == []
    answer = server.ask("POST", "/operator/backups", operator)
    assert (answer.status_code, answer.json()["state"]) == (202, "queued")
    again = server.ask("POST", "/operator/backups", operator)
    assert (again.status_code, code(again)) == (409, "upkeep-busy")
    assert page(server, operator)["run"]["kind"] == "make"
    settings = work(server).settings
    found = page(server, operator)
    (made,) = found["backups"]
    assert (found["run"], found["last"]["state"], found["error"]) == (None, "done", "")
    assert (made["differences"], made["compared_rows"]) == ([], True)
    assert made["rows"] > 0
    assert made["size"] == (folder / made["name"]).stat().st_size
    path = f"/operator/backups/{made['name']}"
    assert server.ask("POST", f"{path}/try", operator).status_code == 202
    work(server)
    (tried,) = page(server, operator)["backups"]
    assert tried["tried_at"] > made["tried_at"]
    download = server.ask("GET", f"{path}/file", operator)
    assert download.content == (folder / made["name"]).read_bytes()
    assert made["name"] in download.headers["content-disposition"]
    assert download.headers["cache-control"] == "private, no-store"
    rest = server.ask("GET", f"{path}/file", operator, headers={"range": "bytes=512-"})
    assert rest.content == download.content[512:]
    assert [one for one, _ in logged(server, operator)] == [
        "backup.make",
        "backup.try",
        "backup.download",
        "backup.download",
    ]
    assert open_target(settings).find(made["name"]).is_equal


def test_a_download_needs_a_proof_within_fifteen_minutes(
    world: World, folder: Path, operator: Somebody
) -> None:
    server = world.server
    (folder / "gym.tar").write_bytes(b"a backup")
    confirmed_before(server, operator, 16)
    refused = server.ask("GET", "/operator/backups/gym.tar/file", operator)
    assert (refused.status_code, code(refused)) == (403, "confirm-operator")
    assert logged(server, operator) == []
    confirmed_before(server, operator, 14)
    assert server.ask("GET", "/operator/backups/gym.tar/file", operator).content == b"a backup"


@pytest.mark.parametrize(
    "name", ["..%2Fgym.tar", "%2Fetc%2Fpasswd.tar", ".hidden.tar", "gym.sqlite", "a%0Ab.tar"]
)
def test_no_other_file_is_downloaded(
    world: World, folder: Path, operator: Somebody, name: str
) -> None:
    (folder.parent / "gym.tar").write_bytes(b"not a backup at the target")
    answer = world.server.ask("GET", f"/operator/backups/{name}/file", operator)
    assert answer.status_code in (404, 422)
    missing = world.server.ask("POST", "/operator/backups/none.tar/try", operator)
    assert (missing.status_code, code(missing)) == (404, "not-there-backup")


def test_a_link_at_the_target_leads_to_no_other_file(
    world: World, folder: Path, operator: Somebody
) -> None:
    (folder.parent / "secret").write_bytes(b"a secret")
    (folder / "gym.tar").symlink_to(folder.parent / "secret")
    answer = world.server.ask("GET", "/operator/backups/gym.tar/file", operator)
    assert b"secret" not in answer.content


def test_a_target_that_is_away_is_explained(world: World, folder: Path, operator: Somebody) -> None:
    folder.rmdir()
    found = page(world.server, operator)
    assert found["error"] == "backups: the folder of backups is not there"
    assert found["target"] == "backups"
    refused = world.server.ask("POST", "/operator/backups", operator)
    assert refused.status_code == 422


def test_a_failed_run_is_shown(world: World, folder: Path, operator: Somebody) -> None:
    server = world.server
    (folder / "gym.tar").write_bytes(b"damaged")
    assert server.ask("POST", "/operator/backups/gym.tar/try", operator).status_code == 202
    work(server)
    last = page(server, operator)["last"]
    assert (last["state"], last["kind"], last["name"]) == ("failed", "try", "gym.tar")
    assert "gym.tar: " in last["error"]
    assert str(folder) not in last["error"]


def test_a_restoration_needs_the_servers_name_and_no_other_worker(
    world: World, folder: Path, operator: Somebody
) -> None:
    server = world.server
    (folder / "gym.tar").write_bytes(b"a backup")
    path = "/operator/backups/gym.tar/restore"
    name = page(server, operator)["server"]
    assert name == "walls.example.com"
    wrong = server.ask("POST", path, operator, {"server": "other.example.com"})
    assert (wrong.status_code, code(wrong)) == (422, "restore-wrong-name")
    missing = server.ask("POST", "/operator/backups/none.tar/restore", operator, {"server": name})
    assert (missing.status_code, code(missing)) == (404, "not-there-backup")
    with WorkerSlot(server.settings, server.database), WorkerSlot(server.settings, server.database):
        used = server.ask("POST", path, operator, {"server": name})
    assert (used.status_code, code(used)) == (409, "gym-in-use")
    restoration = server.app.state.services.get(Restoration)
    stopped: list[bool] = []
    restoration.stop = lambda: stopped.append(True)
    assert server.ask("POST", path, operator, {"server": name.upper()}).status_code == 202
    again = server.ask("POST", path, operator, {"server": name})
    assert (again.status_code, code(again)) == (409, "upkeep-busy")
    assert (restoration.wanted, stopped) == (("gym.tar", operator.id), [True])
    assert logged(server, operator)[0] == ("backup.begin-restore", "gym.tar")
