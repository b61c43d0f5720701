"""Commands of an operator: purge, doctor, jobs, metrics and logs."""

from __future__ import annotations

import json
import logging
import logging.config
import os
import re
import time
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from gym.tests.worlds import Server, World, hold
from sqlalchemy import select, update

from walltopo.cli import main
from walltopo.core import InputError
from walltopo_gym.accounts.models import SignIn
from walltopo_gym.api.middleware import LONGEST_BODY
from walltopo_gym.api.services import Services
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError
from walltopo_gym.operating import doctor
from walltopo_gym.operating.doctor import Finding, examine
from walltopo_gym.operating.jobs import cancel_scan, job_lines, retry_scan
from walltopo_gym.operating.purge import purge
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State
from walltopo_gym.server.app import build_app
from walltopo_gym.server.request_log import log_config
from walltopo_gym.settings import load_settings


def age(server: Server, *keys: str) -> None:
    """Let files of the store be two days old."""
    late = time.time() - 2 * 86400
    for key in keys:
        os.utime(server.settings.data / "files" / key, (late, late))


def test_a_purge_takes_what_nothing_names_and_no_more(world: World) -> None:
    server, store = world.server, world.server.services.store
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    world.photo(scan, state="usable", sha256="aa")
    kept = ["originals/aa", "thumbnails/aa.jpg", "content/abcd", f"scans/{scan}/routes.json"]
    gone = [
        "originals/bb",
        "content/ffff",
        "thumbnails/bb.jpg",
        "scans/00000000-0000-0000-0000-000000000000/routes.json",
    ]
    for key in [*kept[:2], *gone, "originals/young"]:
        store.put(key, b"x")
    age(server, *kept, *gone)
    somebody = server.person()
    with server.database.writing() as session:
        late = update(SignIn).where(SignIn.person_id == somebody.id)
        session.execute(late.values(expires_at=now() - timedelta(days=1)))
    settings = server.settings
    planned = purge(settings, server.database, store, really=False)
    assert set(gone) <= set(planned.files)
    assert planned.rows >= 1
    assert all(store.has(key) for key in gone)
    assert purge(settings, server.database, store).files == planned.files
    assert [key for key in gone if store.has(key)] == []
    assert [key for key in [*kept, "originals/young"] if not store.has(key)] == []
    # Originals go after their time, once the wall has long been published; the wall stays.
    published = update(Scan).where(Scan.id == scan)
    with server.database.writing() as session:
        at = now() - timedelta(days=400)
        session.execute(published.values(state=State.PUBLISHED, published_at=at))
    assert purge(settings, server.database, store).files == ["originals/aa"]
    store.drop(["originals/young"])


def test_the_doctor_says_what_is_well_and_what_is_not(world: World, tmp_path: Path) -> None:
    found = {f.what: f for f in examine(world.server.settings)}
    assert {f.state for name, f in found.items() if name in ("database", "files", "address")} == {
        "well"
    }
    assert found["mail"].state == "look"
    (tmp_path / "files").write_text("in the way")
    bad = {"data": tmp_path, "address": "http://gym.example", "keep_free_mb": 10**9}
    ill = {f.what: f.state for f in examine(load_settings(bad, {}))}
    assert (ill["files"], ill["room"], ill["address"]) == ("bad", "bad", "bad")


def test_each_finding_that_needs_attention_has_the_line_that_mends_it(tmp_path: Path) -> None:
    bad = {"data": tmp_path, "address": "http://gym.example", "keep_free_mb": 10**9}
    found = [*examine(load_settings(bad, {}))]
    assert len({one.state for one in found}) == 3
    assert all(bool(one.mend) == (one.state != "well") for one in found)


def test_the_doctor_names_what_the_products_own_errors_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(database: object) -> str:
        raise InputError("the migrations cannot be read")

    monkeypatch.setattr(doctor, "age_of", refused)
    (tmp_path / "gym.sqlite").touch()
    found = {f.what: f for f in examine(load_settings({"data": tmp_path}, {}))}
    why = "the migrations cannot be read"
    mend = "walltopo gym migrate --data DIR"
    assert found["database"] == Finding("database", "bad", why, mend)


@pytest.mark.parametrize(("lacks", "state"), [("torch", "look"), ("nothing", "well")])
def test_the_doctor_looks_for_what_a_training_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lacks: str, state: str
) -> None:
    monkeypatch.setattr(doctor, "find_spec", lambda name: None if name == lacks else name)
    settings = load_settings({"data": tmp_path, "own_networks": True}, {})
    found = {f.what: f for f in examine(settings)}["own networks"]
    assert (found.state, lacks in found.message) == (state, lacks == "torch")


def test_an_operator_sees_and_moves_jobs(world: World) -> None:
    scan = world.scan(State.FAILED, usable=3)
    assert any(str(scan) in line for line in job_lines(world.server.database))
    with world.server.database.writing() as session:
        retry_scan(session, scan)
        cancel_scan(session, scan)
        with pytest.raises(ConflictError):
            cancel_scan(session, scan)
        assert session.scalar(select(Scan.state).where(Scan.id == scan)) == State.CANCELLED


@pytest.mark.parametrize("what", ["list", "retry"])
def test_the_command_for_jobs_ends(
    world: World, what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It once listed DBOS's jobs inside of a write transaction, for which DBOS waited for ever."""
    scan = world.scan(State.FAILED, usable=3)
    settings = world.server.settings
    place = ["--data", str(settings.data), "--database", settings.database_url]
    given = [str(scan)] if what == "retry" else []
    assert main(["gym", "jobs", what, *given, *place]) == 0
    assert f"{scan} {'queued' if what == 'retry' else 'failed'}" in capsys.readouterr().out


def test_an_operator_does_not_take_a_scan_out_of_review(world: World) -> None:
    scan = world.scan(State.REVIEW, usable=3)
    with world.server.database.writing() as session:
        with pytest.raises(ConflictError):
            cancel_scan(session, scan)
        assert session.scalar(select(Scan.state).where(Scan.id == scan)) == State.REVIEW


def _again(server: Server, **settings: Any) -> Any:
    """The application with other settings over the same services."""
    kept = server.settings
    changed = kept.model_copy(update=settings)
    fields = {name: getattr(server.services, name) for name in Services.__dataclass_fields__}
    return server.client(build_app(Services(**(fields | {"settings": changed}))))


def test_figures_are_for_who_has_the_token(server: Server) -> None:
    assert server.client().get("/metrics").status_code == 404
    client = _again(server, metrics_token="figures")
    assert client.get("/metrics", headers={"authorization": "Bearer other"}).status_code == 404
    client.get("/api/v1/gyms")
    client.get("/nowhere/17")
    metrics = client.get("/metrics", headers={"authorization": "Bearer figures"}).text
    assert 'walltopo_requests_total{endpoint="list_gyms",status="200"} 1.0' in metrics
    assert 'walltopo_scans{state="failed"}' in metrics
    assert "nowhere" not in metrics


def test_a_network_that_asks_too_often_waits(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The minute must not turn between two requests: the window would slide and admit one more.
    stopped = SimpleNamespace(time=lambda: 1_800_000_000.0)
    monkeypatch.setattr("limits.storage.memory.time", stopped)
    client = _again(server, requests_per_minute=5)
    statuses = [client.get("/health").status_code for _ in range(7)]
    assert statuses == [200] * 5 + [429] * 2
    assert client.get("/health").headers["retry-after"] == "60"


def test_the_apps_files_are_not_counted(server: Server) -> None:
    client = _again(server, requests_per_minute=5)
    files = re.findall(r'"(/assets/[^"]+)"', client.get("/").text)
    assert len(files) > 3
    assert {client.get(file).status_code for file in files * 5} == {200}
    assert client.get("/health").status_code == 200


def test_a_body_that_is_too_long_is_refused(world: World) -> None:
    client = world.server.client()
    headers = world.people["owner"].headers | {"content-type": "application/json"}
    long = b" " * (LONGEST_BODY + 1)
    assert client.patch("/api/v1/me", content=long, headers=headers).status_code == 413


def test_a_log_line_bears_the_requests_id(server: Server, capsys: Any) -> None:
    config = log_config("json")
    del config["root"]
    config["loggers"] = {"walltopo_gym.requests": config["loggers"]["walltopo_gym"]}
    logging.config.dictConfig(config)
    try:
        path = "/api/v1/gyms?cursor=secret"
        answer = server.client().get(path, headers={"x-request-id": "proxy-1234"})
        odd = server.client().get("/health", headers={"x-request-id": "two words\\"})
    finally:
        log = logging.getLogger("walltopo_gym.requests")
        log.handlers.clear()
        log.propagate = True
    assert answer.headers["x-request-id"] == "proxy-1234"
    assert "words" not in odd.headers["x-request-id"]
    lines = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    line = next(line for line in lines if line["request"] == "proxy-1234")
    assert (line["path"], line["status"]) == ("/api/v1/gyms", 422)
    assert line["ms"] >= 0
