"""Asking for a scan, and what becomes of a job that is no longer wanted."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from anyio import to_thread
from gym.tests.worlds import World
from tests.breakpoints.breakpoint import Breakpoint

from walltopo_gym.errors import ConflictError
from walltopo_gym.scans.http import scans
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State, change_state
from walltopo_gym.scans.stages import ScanSteps


def steps(world: World, tmp_path: Path) -> ScanSteps:
    services = world.server.services
    return ScanSteps(services.settings, services.database, services.store, tmp_path)


def row_of(world: World, scan: object) -> Scan:
    with world.server.database.reading() as session:
        return session.get_one(Scan, scan)


def ask(world: World, scan: object, what: str) -> int:
    path = f"{world.path}/scans/{scan}/{what}"
    return world.server.ask("POST", path, world.people["setter"]).status_code


def test_a_scan_starts_with_usable_photos_only(world: World) -> None:
    scan = world.scan(usable=2)
    assert ask(world, scan, "start") == 409
    world.photo(scan, state="usable")
    world.photo(scan)
    assert ask(world, scan, "start") == 409  # one is still on its way
    assert row_of(world, scan).state == State.UPLOADING


def test_a_run_that_was_replaced_changes_nothing(world: World, tmp_path: Path) -> None:
    """Cancelled and started again while a worker was at it: the first run is not heard."""
    scan = world.scan(usable=3)
    assert ask(world, scan, "start") == 200
    worker = steps(world, tmp_path)
    assert worker.claim(scan, 1)
    assert ask(world, scan, "cancel") == 200
    assert ask(world, scan, "start") == 200
    assert not worker.claim(scan, 1)
    worker.fail(scan, 1, '{"message": "late", "hint": "", "defect": false}')
    with pytest.raises(ConflictError), world.server.database.writing() as session:
        change_state(session, scan, State.REVIEW, run=1)
    assert (row_of(world, scan).state, row_of(world, scan).run) == (State.QUEUED, 2)
    assert worker.claim(scan, 2)
    worker.fail(scan, 2, '{"message": "no overlap", "hint": "Take more.", "defect": false}')
    failed = row_of(world, scan)
    assert (failed.state, failed.error, failed.hint) == (State.FAILED, "no overlap", "Take more.")


def test_a_scan_that_is_gone_is_not_begun(world: World, tmp_path: Path) -> None:
    scan = world.scan(State.QUEUED)
    path = f"{world.path}/walls/{world.wall.id}"
    assert world.server.ask("DELETE", path, world.owner).status_code == 204
    assert not steps(world, tmp_path).claim(scan, 0)


def test_photos_that_show_no_wall_fail_in_words(world: World, tmp_path: Path) -> None:
    """The real child on three files that are no photos."""
    scan = world.scan(usable=3)
    store = world.server.services.store
    with world.server.database.writing() as session:
        row = session.get_one(Scan, scan)
        row.state, row.run = State.RUNNING, 1
    store.put("originals/None", b"no photo")
    worker = steps(world, tmp_path)
    why = worker.stage(scan, 1, "ingest")
    worker.fail(scan, 1, why)
    worker.release(scan, 1)
    failed = row_of(world, scan)
    assert failed.state == State.FAILED
    assert "usable" in failed.error
    assert "Add photos" in failed.hint
    assert list(tmp_path.iterdir()) == []


def test_a_scan_that_wants_too_much_memory_is_ended(
    world: World, tmp_path: Path, child_breakpoint: Breakpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The child does not end before the worker has looked at its memory.
    for name, value in child_breakpoint.at("stage:ingest").items():
        monkeypatch.setenv(name, value)
    scan = world.scan(State.RUNNING, usable=3)
    world.server.services.store.put("originals/None", b"no photo")
    worker = steps(world, tmp_path)
    worker.settings = worker.settings.model_copy(update={"stage_memory_mb": 1})
    why = worker.stage(scan, 0, "export")
    worker.fail(scan, 0, why)
    worker.release(scan, 0)
    failed = row_of(world, scan)
    assert (failed.state, "memory" in failed.error) == (State.FAILED, True)


def test_a_cancelled_scan_stays_cancelled(world: World, tmp_path: Path) -> None:
    scan = world.scan(State.CANCELLED, usable=3)
    world.server.services.store.put("originals/None", b"no photo")
    worker = steps(world, tmp_path)
    # Whatever the child came to: the row decides, unless it was quicker.
    assert worker.stage(scan, 0, "export") != ""
    worker.release(scan, 0)
    assert row_of(world, scan).state == State.CANCELLED


def test_watchers_get_every_change(
    world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Server-sent events until the scan is nobody's work any more."""
    scan = world.scan(usable=3)
    assert ask(world, scan, "start") == 200
    worker = steps(world, tmp_path)
    no_overlap = '{"message": "no overlap", "hint": "", "defect": false}'
    changes = iter([lambda: worker.claim(scan, 1), lambda: worker.fail(scan, 1, no_overlap)])

    async def pause(seconds: float) -> None:
        """Change the scan between two looks of the server."""
        await to_thread.run_sync(next(changes))

    monkeypatch.setattr(scans, "sleep", pause)
    path = f"{world.path}/scans/{scan}/events"
    answer = world.server.ask("GET", path, world.people["setter"])
    assert answer.headers["content-type"].startswith("text/event-stream")
    lines = answer.text.splitlines()
    messages = [
        json.loads(line.removeprefix("data:")) for line in lines if line.startswith("data:")
    ]
    states = [facts["state"] for facts in messages]
    assert states == [State.QUEUED, State.RUNNING, State.FAILED]
    assert messages[-1]["error"] == "no overlap"
