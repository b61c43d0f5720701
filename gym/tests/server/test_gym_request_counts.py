"""Servers with one database share the limit of requests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from gym.tests.running import wait_for
from gym.tests.worlds import ORIGIN, Server, new_database
from limits import RateLimitItemPerMinute
from limits.strategies import SlidingWindowCounterRateLimiter
from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from starlette.testclient import TestClient

from walltopo_gym.api import request_counts
from walltopo_gym.api.request_counts import SharedCounts
from walltopo_gym.storage.models import RequestCount

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
def server(tmp_path: Path, postgres: str) -> Iterator[Server]:
    """A server whose database others may share."""
    made = Server(tmp_path, new_database(postgres))
    yield made
    made.close()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that tests move; it begins with a window."""
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


def test_what_may_have_arrived_is_not_sent_again(
    server: Server, clock: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    counter = Counter(server)
    counter.admit(10)
    add = counter.counts._add

    def add_and_fail(*args: Any) -> None:
        add(*args)
        raise OperationalError("COMMIT", {}, Exception("the connection is lost"))

    monkeypatch.setattr(counter.counts, "_add", add_and_fail)
    for _ in range(3):
        with pytest.raises(OperationalError):
            counter.counts.exchange()
    monkeypatch.setattr(counter.counts, "_add", add)
    counter.counts.exchange()
    with server.database.reading() as session:
        assert sum(session.scalars(select(RequestCount.count))) == 10
    assert counter.admit(LIMIT) == LIMIT - 10


def test_networks_that_are_gone_take_no_memory(server: Server, clock: list[float]) -> None:
    counter = Counter(server)
    for number in range(50):
        counter.admit(1, f"10.0.1.{number}")
    clock[0] += 300
    counter.counts.exchange()
    assert not counter.counts._lives
    assert not counter.counts._new


def test_what_nobody_shares_takes_no_memory(tmp_path: Path) -> None:
    alone = Server(tmp_path)
    counter = Counter(alone)
    assert counter.admit(LIMIT + 5) == LIMIT
    assert not counter.counts._lives
    alone.close()


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
