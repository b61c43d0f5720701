"""An empty server is restored from a browser by those who read its log, and by nobody else."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from gym.tests.operating.test_gym_operator_access import code
from gym.tests.running import Process, wait_for
from gym.tests.worlds import Server, World, make_world, new_database

from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.operating.backup import back_up
from walltopo_gym.operating.restoration import Restoration
from walltopo_gym.operating.setup import UPLOADED, Setup
from walltopo_gym.server.app import PREFIX


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Server]:
    """A server without any account."""
    (tmp_path / "empty").mkdir()
    made = Server(tmp_path / "empty")
    yield made
    made.close()


def opened(server: Server) -> str:
    """Let an empty server accept a code, and return it."""
    secret, _ = new_secret()
    server.services.get(Setup).open(secret)
    return secret


def post(server: Server, path: str, body: object) -> httpx.Response:
    return server.ask("POST", f"/setup/{path}", json=body)


def upload(server: Server, secret: str, content: bytes, **headers: str) -> httpx.Response:
    given = {"x-walltopo-setup": secret} | headers
    return server.ask("PUT", "/setup/backup", headers=given, content=content)


def test_nobody_restores_without_the_code(empty: Server) -> None:
    """Nor before one was made, nor once there is an account."""
    for secret in ("", "wrong"):
        refused = post(empty, "backups", {"code": secret or "none"})
        assert (refused.status_code, code(refused)) == (422, "setup-code-wrong")
    secret = opened(empty)
    assert post(empty, "backups", {"code": secret}).json() == {
        "error": "",
        "failed": "",
        "backups": [],
    }
    assert post(empty, "backups", {"code": f"{secret}x"}).status_code == 422
    assert upload(empty, "wrong", b"a backup").status_code == 422
    assert not (empty.settings.data / UPLOADED).exists()
    empty.person("somebody")
    for refused in (
        post(empty, "backups", {"code": secret}),
        upload(empty, secret, b"a backup"),
        post(empty, "restore", {"code": secret, "name": None}),
    ):
        assert (refused.status_code, code(refused)) == (422, "setup-code-wrong")


def test_another_sites_page_uploads_nothing(empty: Server) -> None:
    secret = opened(empty)
    refused = upload(empty, secret, b"a backup", origin="https://evil.example")
    assert refused.status_code == 403
    assert not (empty.settings.data / UPLOADED).exists()


def test_a_broken_upload_leaves_nothing(empty: Server) -> None:
    secret = opened(empty)
    cut = upload(empty, secret, b"a part", **{"content-length": "100"})
    assert cut.status_code >= 400
    assert not (empty.settings.data / UPLOADED).exists()
    assert upload(empty, secret, b"", **{"content-length": "0"}).status_code == 422
    assert post(empty, "restore", {"code": secret, "name": None}).status_code == 404


def test_an_uploaded_backup_is_restored_next(empty: Server) -> None:
    secret = opened(empty)
    restoration = empty.services.get(Restoration)
    restoration.stop = lambda: None
    assert upload(empty, secret, b"a backup").status_code == 204
    assert (empty.settings.data / UPLOADED).read_bytes() == b"a backup"
    assert (empty.settings.data / UPLOADED).stat().st_mode & 0o077 == 0
    assert post(empty, "restore", {"code": secret, "name": None}).status_code == 202
    assert restoration.wanted == (UPLOADED, None)
    for name in ("../gym.tar", UPLOADED, "/etc/passwd.tar"):
        assert post(empty, "restore", {"code": secret, "name": name}).status_code == 422


@pytest.fixture(params=["sqlite", "postgresql"])
def saved(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[World, str]:
    """A gym whose backup is at a target, and the URL of another empty database."""
    urls = ["", ""]
    if request.param == "postgresql":
        address = request.getfixturevalue("postgres")
        urls = [new_database(address), new_database(address)]
    for name in ("first", "backups", "second"):
        (tmp_path / name).mkdir()
    world = make_world(Server(tmp_path / "first", urls[0]), visibility="public")
    services = world.server.services
    services.store.put("content/setup", b"a file")
    file = tmp_path / "backups" / "gym.tar"
    back_up(services.settings, services.database, services.store, file)
    world.server.close()
    return world, urls[1]


def secret_in(log: Path) -> str:
    """Return the code that the log shows."""
    found: re.Match[str] = wait_for(lambda: re.search(r"/setup#(\S+)\s", log.read_text()))
    return found[1]


def setup_of(client: httpx.Client, secret: str) -> dict[str, Any]:
    """Return what the page of an empty server shows; nothing while the server does not answer."""
    answer = client.post("/setup/backups", json={"code": secret})
    found: dict[str, Any] = answer.json() if answer.is_success else {}
    return found


@pytest.mark.slow
@pytest.mark.both_databases("the switch moves files, or renames databases")
@pytest.mark.parametrize("uploaded", [True, False], ids=["uploaded", "at the target"])
def test_an_empty_server_becomes_the_gym_of_a_backup(
    saved: tuple[World, str], tmp_path: Path, uploaded: bool
) -> None:
    world, url = saved
    data, file = tmp_path / "second", tmp_path / "backups" / "gym.tar"
    words = ["--port", "0", *(["--database", url] if url else [])]
    process = Process(data, "serve", *words, backup_to=str(file.parent))
    try:
        client = httpx.Client(base_url=process.first_line + PREFIX, timeout=600)
        secret = secret_in(data / "serve.log")
        listed = client.post("/setup/backups", json={"code": secret}).json()["backups"]
        assert [one["name"] for one in listed] == ["gym.tar"]
        name: Any = "gym.tar"
        if uploaded:
            name = None
            damaged = file.read_bytes()[:20_000]
            headers = {"x-walltopo-setup": secret}
            assert client.put("/setup/backup", content=damaged, headers=headers).is_success
            body = {"code": secret, "name": None}
            assert client.post("/setup/restore", json=body).status_code == 202
            # It fails, and the server is empty as before.
            failed = wait_for(lambda: setup_of(client, secret).get("failed"))
            assert "cannot be read as a backup" in failed or "cut off" in failed
            with file.open("rb") as stream:
                size = {"content-length": str(file.stat().st_size)}
                answer = client.put("/setup/backup", content=stream, headers=headers | size)
            assert answer.status_code == 204
        body = {"code": secret, "name": name}
        assert client.post("/setup/restore", json=body).status_code == 202
        found = wait_for(lambda: client.get(world.path).is_success and client.get(world.path))
        assert found.json()["name"] == world.gym.name
        refused = client.post("/setup/backups", json={"code": secret})
        assert (refused.status_code, code(refused)) == (422, "setup-code-wrong")
        assert not (data / UPLOADED).exists()
    finally:
        process.stop()
