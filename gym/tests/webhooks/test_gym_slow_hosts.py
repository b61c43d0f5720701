"""A host that answers slowly holds up its own gym's messages, for a bounded time."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from uuid import uuid4

import pytest
from gym.tests.worlds import Server, World, make_world
from sqlalchemy import delete

from walltopo_gym.clock import now
from walltopo_gym.hall.models import Message, PushAddress
from walltopo_gym.hall.telling import Telling
from walltopo_gym.webhooks import sending
from walltopo_gym.webhooks.delivery import Delivery
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.sending import post


@pytest.fixture
def dripping() -> Iterator[str]:
    """A host that promises an answer and sends a byte of it now and then."""
    listener = socket.create_server(("127.0.0.1", 0))
    ended = threading.Event()

    def drip() -> None:
        stream, _ = listener.accept()
        with stream:
            stream.sendall(b"HTTP/1.1 200 OK\r\nx: ")
            while not ended.wait(0.1):
                try:
                    stream.sendall(b"y")
                except OSError:
                    return

    thread = threading.Thread(target=drip)
    thread.start()
    yield f"http://127.0.0.1:{listener.getsockname()[1]}/"
    ended.set()
    thread.join()
    listener.close()


def test_an_exchange_has_a_deadline(dripping: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sending, "_DEADLINE_S", 1)
    begun = time.monotonic()
    with pytest.raises(OSError, match="within 1 s"):
        post(dripping, b"{}", {}, private=True)
    assert time.monotonic() - begun < 30


@pytest.fixture
def worlds(server: Server) -> tuple[World, World]:
    with server.database.writing() as session:
        for kind in (WebhookEvent, Message):
            session.execute(delete(kind))
    return make_world(server), make_world(server)


def test_a_gym_has_two_webhooks_at_a_time(worlds: tuple[World, World]) -> None:
    server = worlds[0].server
    gyms = {}
    with server.database.writing() as session:
        for world, number in zip(worlds, (10, 1), strict=True):
            for _ in range(number):
                row = Webhook(gym_id=world.gym.id, url="https://slow.example/", secret="whsec_AAAA")
                session.add(row)
                session.flush()
                event = WebhookEvent(webhook_id=row.id, body={"type": "t"})
                session.add(event)
                session.flush()
                gyms[event.id] = world
    delivery = Delivery(server.settings, server.database)
    begun = [event for event, _ in delivery.claim()]
    assert [gyms[event] for event in begun].count(worlds[0]) == 2
    assert [gyms[event] for event in begun].count(worlds[1]) == 1
    assert delivery.claim() == []
    delivery.try_once(next(event for event in begun if gyms[event] is worlds[0]))
    assert len(delivery.claim()) == 1


def test_a_gym_has_two_pushes_at_a_time(worlds: tuple[World, World]) -> None:
    server = worlds[0].server
    with server.database.writing() as session:
        for world, number in zip(worlds, (10, 1), strict=True):
            person = world.people["member"].id
            for _ in range(number):
                target = PushAddress(
                    person_id=person, endpoint=f"https://slow.example/{uuid4()}", public_key="k",
                    secret="s",
                )  # fmt: skip
                session.add(target)
                session.flush()
                session.add(
                    Message(person_id=person, gym_id=world.gym.id, kind="fresh", next_at=now(),
                            subject=str(target.id), target=str(target.id), body={})
                )  # fmt: skip
    for world in worlds:
        answer = {"fresh": True, "quiet_from": 0, "quiet_to": 0}
        assert server.ask("PUT", "/me/messages", world.people["member"], answer).is_success
    telling = Telling(server.settings, server.database, server.outbox)
    assert len(telling.claim()) == 3
    assert telling.claim() == []
