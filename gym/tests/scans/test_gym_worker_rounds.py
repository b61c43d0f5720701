"""A worker's chores, its looks at photos and its heartbeat do not wait for each other."""

from __future__ import annotations

import threading
from datetime import datetime

import pytest
from gym.tests.running import wait_for
from gym.tests.worlds import Server, make_world

from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.scans import worker
from walltopo_gym.scans.models import Worker
from walltopo_gym.scans.stages import ScanSteps
from walltopo_gym.uploads.looking import look_at_some


def heard_of(server: Server, name: str) -> datetime | None:
    with server.database.reading() as session:
        row = session.get(Worker, name)
        return None if row is None else row.at


def test_neither_photos_nor_a_slow_chore_delay_the_heartbeat(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = server.settings.model_copy(update={"silent_s": 2})
    steps = ScanSteps.of(settings, server.database, server.services.store)
    stop, looking, published = threading.Event(), threading.Event(), threading.Event()
    beats: list[datetime] = []

    def look(*_: object) -> None:
        """A flood of photos that never ends."""
        looking.set()
        stop.wait()

    def chore() -> None:
        published.set()
        first = heard_of(server, "busy")
        assert first is not None
        beats.append(first)
        beats.append(wait_for(lambda: (at := heard_of(server, "busy")) and at > first and at))
        stop.set()

    monkeypatch.setattr(worker, "look_at_all", look)
    monkeypatch.setattr(worker, "begin_queued", lambda *_: None)
    monkeypatch.setattr(worker, "_take_over", lambda *_: None)
    worker._work(steps, "busy", stop, (chore,))
    assert looking.is_set()
    assert published.is_set()
    assert len(beats) == 2
    with server.database.writing() as session:
        session.delete(session.get_one(Worker, "busy"))


def test_a_flood_of_photos_delays_no_other_gyms(server: Server) -> None:
    """A batch takes the first photo of each gym, then the second one of each."""
    flooded, other = make_world(server), make_world(server)
    scan = flooded.scan()
    for number in range(40):
        flooded.photo(scan, state="received", sha256=f"flood-{number}", name=f"{number}.jpg")
    last = other.photo(other.scan(), state="received", sha256="other", name="other.jpg")
    look_at_some(server.database, server.services.store)
    with server.database.reading() as session:
        assert session.get(JobAttempt, ("photo", last)) is not None
    for world in (flooded, other):
        server.ask("DELETE", f"{world.path}/walls/{world.wall.id}", world.owner)
