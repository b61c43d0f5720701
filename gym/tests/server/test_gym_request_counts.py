"""Servers with one database share the limit of requests."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from gym.tests.running import wait_for
from gym.tests.worlds import ORIGIN, Server, new_database
from limits import RateLimitItemPerMinute
from limits.strategies import SlidingWindowCounterRateLimiter
from sqlalchemy import delete, select
from starlette.testclient import TestClient

from walltopo_gym.api import request_counts
from walltopo_gym.api.request_counts import SharedCounts
from walltopo_gym.storage.models import RequestCount

pytestmark = pytest.mark.both_databases("counts are added by a conflict of keys")

LIMIT = 20


class Counter:
    """The counter of one of several servers."""

    def __init__(self, server: Server) -> None:
        self.counts = SharedCounts(server.database, LIMIT)
        self._limiter = SlidingWindowCounterRateLimiter(self.counts)

    def admit(self, requests: int, network: str = "10.0.0.1") -> int:
        """Send requests; return how many are admitted."""
        limit = RateLimitItemPerMinute(LIMIT)
        return sum(self._limiter.hit(limit, network) for _ in range(requests))


@pytest.fixture
def clock(server: Server, monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that tests move; it begins with a window that nobody has used."""
    with server.database.writing() as session:
        session.execute(delete(RequestCount))
    at = [1_800_000_000.0]
    monkeypatch.setattr("limits.storage.memory.time", SimpleNamespace(time=lambda: at[0]))
    return at


def test_two_servers_admit_what_one_admits(server: Server, clock: list[float]) -> None:
    first, second = Counter(server), Counter(server)
    assert (first.admit(12), second.admit(5)) == (12, 5)
    first.counts.exchange()
    second.counts.exchange()
    assert second.admit(10) == 3  # it knows of the 12
    first.counts.exchange()
    second.counts.exchange()
    first.counts.exchange()
    assert (first.admit(5), second.admit(5)) == (0, 0)
    assert first.admit(5, "10.0.0.2") == 5
    # Nothing is counted twice, and a new window is free again.
    clock[0] += 120
    for counter in (first, second, first):
        counter.counts.exchange()
    assert first.admit(LIMIT + 5) == LIMIT


def test_a_server_that_comes_later_knows_the_counts(server: Server, clock: list[float]) -> None:
    first = Counter(server)
    first.admit(LIMIT)
    first.counts.exchange()
    later = Counter(server)
    assert later.admit(2) == 2  # a busy network is one with a tenth of the limit
    later.counts.exchange()
    assert later.admit(5) == 0


def test_no_address_and_no_quiet_network_is_stored(server: Server, clock: list[float]) -> None:
    counter = Counter(server)
    counter.admit(1, "10.0.0.9")
    counter.counts.exchange()
    with server.database.reading() as session:
        assert session.scalars(select(RequestCount.key)).all() == []
    counter.admit(5, "10.0.0.9")
    counter.counts.exchange()
    with server.database.reading() as session:
        [row] = session.scalars(select(RequestCount)).all()
    assert (len(row.key), row.count) == (64, 6)


def test_a_server_exchanges_counts_as_long_as_it_serves(
    tmp_path: Path, postgres: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(request_counts, "_EVERY_S", 0.05)
    server = Server(tmp_path, new_database(postgres), requests_per_minute=LIMIT)
    with TestClient(server.app, base_url=ORIGIN) as client:
        for _ in range(5):
            client.get("/health")

        def counted() -> int:
            with server.database.reading() as session:
                return sum(session.scalars(select(RequestCount.count)))

        wait_for(lambda: counted() >= 5)
    server.close()
