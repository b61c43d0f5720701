"""Fixtures that tests of the platform share: a server on each kind of database."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import pytest
from gym.tests.worlds import Server, World, make_world, new_database
from sqlalchemy import delete

from walltopo_gym import clock, mail, outgoing
from walltopo_gym.accounts import oidc
from walltopo_gym.accounts.models import Try
from walltopo_gym.database import engine, lock
from walltopo_gym.storage import pictures

_WEDNESDAY = 2


@pytest.fixture(scope="session", autouse=True)
def _patient() -> Iterator[None]:
    """The product's limits for what is slow; a loaded machine would pass them."""
    with pytest.MonkeyPatch.context() as patch:
        for room in (oidc, mail, pictures, outgoing):
            patch.setattr(room, "_PATIENCE_S", 600)
        patch.setattr(outgoing, "_DEADLINE_S", 600)
        patch.setattr(engine, "_BUSY_S", 600)
        yield


@pytest.fixture(scope="session", params=["sqlite", "postgresql"])
def server(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Server]:
    """A server that the tests of a session share; each makes people and gyms of its own."""
    url = ""
    if request.param == "postgresql":
        url = new_database(request.getfixturevalue("postgres"))
    made = Server(tmp_path_factory.mktemp("server"), url)
    yield made
    made.close()


@pytest.fixture(autouse=True)
def _fresh_limits(request: pytest.FixtureRequest) -> None:
    """All tests ask from one address: what one tried does not count for the next."""
    if "server" in request.fixturenames:
        made: Server = request.getfixturevalue("server")
        with made.database.writing() as session:
            session.execute(delete(Try))


@pytest.fixture(autouse=True)
def _nothing_slow_under_a_lock(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fail where slow work begins while a write transaction is open."""
    found: list[str] = []

    def report(work: str) -> None:
        stack = traceback.extract_stack()
        ours = [
            f"{Path(frame.filename).name}:{frame.lineno} {frame.name}"
            for frame in stack
            if "walltopo_gym" in frame.filename
        ]
        found.append(f"{work}: {' > '.join(ours)}")

    monkeypatch.setattr(lock, "log_slow_work", report)
    yield
    assert not found, "slow work while a write transaction is open:\n" + "\n".join(found)


@pytest.fixture
def midday(monkeypatch: pytest.MonkeyPatch) -> None:
    """The platform's clock begins at noon of the last Wednesday, in UTC, and goes on from there.

    Thus no day, week or month of a gym ends during the test.
    """
    began = datetime.now(UTC)
    wednesday = began - timedelta(days=(began.weekday() - _WEDNESDAY) % 7)
    back = began - wednesday.replace(hour=12, minute=0, second=0)
    roll_back = SimpleNamespace(now=lambda zone: datetime.now(zone) - back)
    monkeypatch.setattr(clock, "datetime", roll_back)


@pytest.fixture
def world(server: Server) -> World:
    """A private gym with one wall and somebody in each role."""
    return make_world(server)
