"""A serving gym is replaced by a backup from the operator's page."""

from __future__ import annotations

import socket
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from gym.tests.running import Process, browser, wait_for
from gym.tests.worlds import Server, Somebody, World, make_world, new_database

from walltopo_gym.languages import LANGUAGES
from walltopo_gym.server.maintenance import in_maintenance

pytestmark = pytest.mark.both_databases("the switch moves files, or renames databases")


@pytest.fixture(params=["sqlite", "postgresql"])
def stopped(request: pytest.FixtureRequest, tmp_path: Path) -> World:
    """A gym whose server is not started yet."""
    url = ""
    if request.param == "postgresql":
        url = new_database(request.getfixturevalue("postgres"))
    (tmp_path / "data").mkdir()
    (tmp_path / "backups").mkdir()
    world = make_world(Server(tmp_path / "data", url))
    world.server.close()
    return world


def serving(world: World, backups: Path) -> Process:
    settings = world.server.settings
    words = ["--port", "0", *(["--database", settings.database] if settings.database else [])]
    return Process(settings.data, "serve", *words, backup_to=str(backups))


def client(process: Process, who: Somebody) -> httpx.Client:
    return browser(process.first_line, who.headers["cookie"].partition("=")[2])


def last_run(operator: httpx.Client, kind: str) -> Any:
    """Return the last run if it is of this kind; nothing while the server does not answer."""
    try:
        answer = operator.get("/operator/backups")
    except httpx.TransportError:
        return None
    last = answer.json()["last"] if answer.is_success else None
    return last if last and last["kind"] == kind else None


def restore(operator: httpx.Client, name: str) -> httpx.Response:
    return operator.post(f"/operator/backups/{name}/restore", json={"server": "localhost"})


@pytest.mark.slow
def test_an_operator_restores_a_backup_over_a_serving_gym(stopped: World, tmp_path: Path) -> None:
    data = stopped.server.settings.data
    process = serving(stopped, tmp_path / "backups")
    try:
        operator = client(process, stopped.people["operator"])
        owner = client(process, stopped.owner)
        assert operator.post("/operator/backups").status_code == 202
        made = wait_for(lambda: last_run(operator, "make"))
        assert (made["state"], made["error"]) == ("done", "")
        assert owner.post(f"{stopped.path}/walls", json={"name": "Later"}).is_success
        assert restore(operator, made["name"]).status_code == 202
        refused = wait_for(lambda: (answer := owner.get("/server")).status_code == 503 and answer)
        assert refused.json()["code"] == "server-restoring"
        assert refused.headers["retry-after"] == "10"
        ended = wait_for(lambda: last_run(operator, "restore"))
        assert (ended["state"], ended["error"]) == ("done", "")
        walls = owner.get(f"{stopped.path}/walls").json()
        assert [wall["name"] for wall in walls] == ["Cave"]
        # The run that made the backup was at work in it: no worker resumes it.
        assert operator.get("/operator/backups").json()["run"] is None
        assert len(list(data.glob("replaced-*"))) == 1

        # A backup that is damaged meanwhile changes nothing.
        assert owner.post(f"{stopped.path}/walls", json={"name": "Roof"}).is_success
        file = tmp_path / "backups" / made["name"]
        file.write_bytes(file.read_bytes()[:20_000])
        assert restore(operator, made["name"]).status_code == 202
        failed = wait_for(lambda: (run := last_run(operator, "restore")) and run["error"] and run)
        assert failed["state"] == "failed"
        walls = owner.get(f"{stopped.path}/walls").json()
        assert sorted(wall["name"] for wall in walls) == ["Cave", "Roof"]
        assert len(list(data.glob("replaced-*"))) == 1
    finally:
        process.stop()


@pytest.mark.slow
def test_a_server_that_is_killed_while_it_restores_starts_whole(
    stopped: World, tmp_path: Path
) -> None:
    process = serving(stopped, tmp_path / "backups")
    operator = client(process, stopped.people["operator"])
    assert operator.post("/operator/backups").status_code == 202
    made = wait_for(lambda: last_run(operator, "make"))
    assert client(process, stopped.owner).patch(stopped.path, json={"name": "Later"}).is_success
    assert restore(operator, made["name"]).status_code == 202
    wait_for(lambda: operator.get("/server").status_code == 503)
    process.kill()
    process = serving(stopped, tmp_path / "backups")
    try:
        name = client(process, stopped.owner).get(stopped.path).json()["name"]
        assert name in ("Later", stopped.gym.name)  # whole: the old data, or the backup's
        operator = client(process, stopped.people["operator"])
        assert restore(operator, made["name"]).status_code == 202
        assert wait_for(lambda: last_run(operator, "restore"))["state"] == "done"
        restored = client(process, stopped.owner).get(stopped.path).json()["name"]
        assert restored == stopped.gym.name
    finally:
        process.stop()


def test_the_page_of_a_server_that_restores_is_plain() -> None:
    with closing(socket.create_server(("127.0.0.1", 0))) as listener:
        address = f"http://127.0.0.1:{listener.getsockname()[1]}"
        with in_maintenance(listener):
            page = wait_for(lambda: httpx.get(f"{address}/g/somewhere", timeout=60))
            health = httpx.get(f"{address}/health", timeout=60)
    assert (page.status_code, health.status_code) == (503, 503)
    assert page.headers["content-type"].startswith("text/html")
    assert page.headers["x-content-type-options"] == "nosniff"
    for language in LANGUAGES:
        assert f'<p lang="{language}">' in page.text
