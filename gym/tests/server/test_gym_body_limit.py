"""A body that is too long gets a 413 of ours, and is no defect."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from typing import Any

import pytest
from gym.tests.running import TUS, announce, offset_of, send
from gym.tests.worlds import ORIGIN, World, hold

from walltopo_gym.api.middleware import LONGEST_BODY
from walltopo_gym.server.app import PREFIX

_PIECE = b" " * 100_000
_TOO_MANY = LONGEST_BODY // len(_PIECE) + 1


def growing() -> Iterator[bytes]:
    """Yield a body whose length is not announced."""
    for _ in range(_TOO_MANY):
        yield _PIECE


def defects(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return what was logged with a traceback or as an error."""
    return [
        record.getMessage()
        for record in caplog.records
        if record.exc_info or record.levelno >= logging.ERROR
    ]


@pytest.mark.parametrize("is_announced", [True, False])
@pytest.mark.parametrize("who", ["owner", "nobody"])
@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("PATCH", "/me"),
        ("POST", "/session"),
        ("PATCH", "{gym}"),
        ("POST", "{gym}/walls"),
        ("PUT", "{gym}/floor-plan/picture"),
    ],
)
def test_a_body_that_grows_too_long_is_refused(
    world: World,
    caplog: pytest.LogCaptureFixture,
    method: str,
    path: str,
    who: str,
    *,
    is_announced: bool,
) -> None:
    caplog.set_level(logging.INFO, "walltopo_gym.requests")
    answer = world.server.client().request(
        method,
        PREFIX + path.format(gym=world.path),
        content=_PIECE * _TOO_MANY if is_announced else growing(),
        headers=world.people[who].headers | {"content-type": "application/json"},
    )
    assert defects(caplog) == []
    refused = {413} if is_announced or who == "owner" else {401, 404, 413}
    assert answer.status_code in refused
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["x-request-id"]
    assert answer.headers["x-content-type-options"] == "nosniff"
    if answer.status_code == 413:
        assert answer.json()["code"] == "body-too-large"
    assert any(f" {answer.status_code}" in record.getMessage() for record in caplog.records)


@pytest.mark.parametrize(
    "path", ["/", "/health", "/nothing", f"{PREFIX}/me/ascents.csv", f"{PREFIX}/gyms"]
)
@pytest.mark.parametrize("method", ["GET", "DELETE"])
def test_a_body_where_none_is_read_is_no_defect(
    world: World, caplog: pytest.LogCaptureFixture, method: str, path: str
) -> None:
    for body in (_PIECE * _TOO_MANY, growing()):
        client = world.server.client()
        answer = client.request(method, path, content=body, headers=world.owner.headers)
        assert answer.status_code < 500
        assert isinstance(body, Iterator) or answer.status_code == 413
    assert defects(caplog) == []


def test_a_body_that_grows_while_a_file_is_sent_breaks_it_off(
    world: World, caplog: pytest.LogCaptureFixture
) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    sent = asyncio.run(_read(world, world.published()["files"]["index.html"]))
    assert [message.get("status") for message in sent] == [200]
    assert defects(caplog) == []


async def _read(world: World, path: str) -> list[Any]:
    """Return what the server sends to somebody whose body begins after the response."""
    sent: list[Any] = []
    has_begun, is_over = asyncio.Event(), asyncio.Event()

    async def receive() -> Any:
        await has_begun.wait()
        is_over.set()
        return {"type": "http.request", "body": _PIECE * _TOO_MANY, "more_body": True}

    async def send(message: Any) -> None:
        sent.append(message)
        has_begun.set()
        await is_over.wait()
        await asyncio.sleep(0)  # until the body was counted

    cookie = [
        (name.encode(), value.encode()) for name, value in world.people["member"].headers.items()
    ]
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": "GET",
        "scheme": "https",
        "path": path,
        "raw_path": path.encode(),
        "query_string": b"",
        "headers": [(b"host", ORIGIN.encode()), *cookie],
        "client": ("192.0.2.1", 1),
        "server": ("walls.example.com", 443),
    }
    await world.server.app(scope, receive, send)
    return sent


def test_a_photo_has_the_limit_that_was_announced(
    world: World, caplog: pytest.LogCaptureFixture
) -> None:
    client = world.server.client()
    client.base_url = client.base_url.join(PREFIX)
    client.headers.update(world.people["setter"].headers)
    content = b"x" * (LONGEST_BODY + 1)
    path = f"{world.path}/scans/{world.scan()}/photos"
    place = announce(client, path, "a.jpg", content).headers["location"]
    more = client.patch(
        place.partition(PREFIX)[2],
        content=(content for _ in range(2)),
        headers=TUS | {"upload-offset": "0", "content-type": "application/offset+octet-stream"},
    )
    assert more.status_code == 413
    assert send(client, place, content, offset_of(client, place)).is_success
    assert defects(caplog) == []
