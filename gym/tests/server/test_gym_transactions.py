"""The rule of an endpoint and the endpoint work in one transaction."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import httpx
import pytest
from anyio import CapacityLimiter
from fastapi import APIRouter, FastAPI
from fastapi.testclient import TestClient
from gym.tests.worlds import ORIGIN, Server, World
from sqlalchemy import event

from walltopo_gym.accounts.access import SignedInMay, declare_rules
from walltopo_gym.api.services import Db
from walltopo_gym.database import lock
from walltopo_gym.database.engine import CONNECTIONS
from walltopo_gym.operating.metrics import Metrics
from walltopo_gym.server.app import PREFIX
from walltopo_gym.server.request_log import RequestLogMiddleware

pytestmark = pytest.mark.both_databases("transactions and locks")


@contextmanager
def _noted(server: Server, what: str, note: Callable[..., None]) -> Iterator[None]:
    """Call `note` with each event of this name of the server's database, during the block."""
    event.listen(server.database.engine, what, note)
    try:
        yield
    finally:
        event.remove(server.database.engine, what, note)


@contextmanager
def statements(server: Server) -> Iterator[list[str]]:
    """Yield the SQL that the server executes meanwhile, without its values."""
    executed: list[str] = []

    def note(_connection: object, _cursor: object, text: str, *_rest: object) -> None:
        executed.append(text)

    with _noted(server, "before_cursor_execute", note):
        yield executed


@contextmanager
def counted(server: Server) -> Iterator[list[object]]:
    """Yield the transactions that the server begins meanwhile."""
    begun: list[object] = []

    def note(connection: object) -> None:
        begun.append(connection)

    with _noted(server, "begin", note):
        yield begun


def test_a_request_takes_one_transaction(world: World) -> None:
    requests = (
        ("GET", f"{world.path}/walls", None, 200),
        ("GET", f"{world.path}/routes", None, 200),
        ("POST", f"{world.path}/walls", {"name": "Slab"}, 201),
        ("GET", "/me", None, 200),
    )
    for method, path, body, status in requests:
        with counted(world.server) as begun:
            assert world.server.ask(method, path, world.owner, body).status_code == status
        assert len(begun) == 1, (method, path)


def test_a_refused_request_changes_nothing(world: World) -> None:
    with counted(world.server) as begun:
        answer = world.server.ask(
            "POST", f"{world.path}/walls", world.people["member"], {"name": "X"}
        )
        assert answer.status_code == 403
    assert len(begun) == 1
    names = [w["name"] for w in world.server.ask("GET", f"{world.path}/walls", world.owner).json()]
    assert "X" not in names


def test_an_endpoint_begins_its_transaction_before_its_rule() -> None:
    router = APIRouter()

    @router.get("/late")
    def read_late(actor: SignedInMay, session: Db) -> None: ...

    with pytest.raises(RuntimeError, match="before the rule"):
        declare_rules(router)


@pytest.mark.parametrize("who", ["nobody", "stranger"])
def test_a_private_gym_costs_strangers_what_a_missing_one_does(world: World, who: str) -> None:
    """The duration of an answer reveals no private gym: both take the same queries."""
    person = world.people[who]
    found = []
    for path in (world.path, "/gyms/never-opened"):
        with statements(world.server) as executed:
            assert world.server.ask("GET", path, person).status_code == 404
        found.append(executed)
    assert found[0] == found[1]
    assert len(found[0]) > 0


@pytest.mark.parametrize("method", ["GET", "PATCH"])
def test_more_requests_than_connections_wait_for_each_other(world: World, method: str) -> None:
    """A request with a transaction waits for a thread; none that holds a thread waits for it."""
    wall = world.server.ask("GET", f"{world.path}/walls", world.owner).json()[0]["id"]

    async def ask(client: httpx.AsyncClient) -> int:
        body = {"name": "Slab"} if method == "PATCH" else None
        path = f"{PREFIX}{world.path}/walls/{wall}"
        return (await client.request(method, path, json=body)).status_code

    async def ask_all() -> list[int]:
        async with httpx.AsyncClient(
            transport=httpx.ASGITransport(world.server.app),
            base_url=ORIGIN,
            headers=world.owner.headers,
        ) as client:
            return await asyncio.gather(*(ask(client) for _ in range(6 * CONNECTIONS)))

    begun = time.monotonic()
    # 409: PostgreSQL lets writers in at once, and all give the wall the same name.
    assert set(asyncio.run(ask_all())) <= {200, 409}
    assert time.monotonic() - begun < 20  # a connection is waited for up to 30 s


def test_slow_work_in_a_write_transaction_is_reported(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fixture of all tests fails where an endpoint does this."""
    found: list[str] = []
    monkeypatch.setattr(lock, "log_slow_work", found.append)
    database, store = world.server.database, world.server.services.store
    store.has("content/none")
    with database.reading():
        store.has("content/none")
    assert found == []
    with database.writing():
        store.has("content/none")
    assert len(found) == 1
    store.has("content/none")
    assert len(found) == 1


def test_slow_work_in_the_transaction_of_an_endpoint_is_reported(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its transaction is begun and ended in other threads than the one that works."""
    found: list[str] = []
    monkeypatch.setattr(lock, "log_slow_work", found.append)
    app = FastAPI()
    app.state.services, app.state.transaction_slots = server.services, CapacityLimiter(1)

    @app.put("/slow")
    def slow(session: Db) -> None:
        server.services.store.has("content/none")

    @app.get("/slow")
    def read(session: Db) -> None:
        server.services.store.has("content/none")

    watched = RequestLogMiddleware(app, Metrics(server.services))
    client = TestClient(watched, base_url=ORIGIN)
    assert client.get("/slow").is_success
    assert found == []
    assert client.put("/slow").is_success
    assert len(found) == 1
    assert client.get("/slow").is_success
    assert len(found) == 1
