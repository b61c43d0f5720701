"""A host that answers slowly holds up its own gym's messages, for a bounded time."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from uuid import uuid4

import pytest
from gym.tests.hurried import at_work, forget_jobs
from gym.tests.notifications.test_gym_notifications import Service
from gym.tests.running import wait_for
from gym.tests.webhooks.test_gym_webhooks import delivery, listener
from gym.tests.worlds import Server, World, make_world
from sqlalchemy import delete
from sqlalchemy.orm import Session

from walltopo_gym import outgoing as sending
from walltopo_gym.jobs.queue import Task, enqueue
from walltopo_gym.notifications.messages import PUSHES
from walltopo_gym.notifications.models import Message, PushAddress
from walltopo_gym.notifications.sending import MessageSender
from walltopo_gym.outgoing import post
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.service import queue_webhook_message


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
    with pytest.raises(OSError, match="within 1 s"):
        post(dripping, b"{}", {}, private=True)


def test_a_name_look_up_has_a_deadline(monkeypatch: pytest.MonkeyPatch) -> None:
    silent = threading.Event()
    monkeypatch.setattr(sending, "_PATIENCE_S", 1)
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: silent.wait())
    with pytest.raises(OSError, match=r"gym\.example was not resolved within 1 s"):
        post("https://gym.example/", b"{}", {}, private=True)
    silent.set()


@pytest.fixture
def worlds(server: Server) -> tuple[World, World]:
    forget_jobs(server)
    with server.database.writing() as session:
        for kind in (WebhookEvent, Message):
            session.execute(delete(kind))
    return make_world(server), make_world(server)


@pytest.fixture
def slow() -> Iterator[Slow]:
    """A host that answers when a test lets it."""
    made = Slow()
    yield made
    made.close()


class Slow:
    """A host that answers nobody until `answer` is set, and counts who waits."""

    def __init__(self) -> None:
        self.answer = threading.Event()
        self.requests: list[str] = []
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                self.rfile.read(int(self.headers["content-length"]))
                outer.requests.append(self.path)
                outer.answer.wait()
                self.send_response(200)
                self.end_headers()

            def log_message(self, *_: object) -> None: ...

        self._http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._http.server_port}/"
        threading.Thread(target=self._http.serve_forever, daemon=True).start()

    def close(self) -> None:
        self.answer.set()
        self._http.shutdown()
        self._http.server_close()


def test_ten_webhooks_to_a_slow_host_hold_up_no_other_gym(
    worlds: tuple[World, World], slow: Slow
) -> None:
    bad, good = worlds
    server = bad.server
    with listener() as (url, received):
        with server.database.writing() as session:
            session.add_all(
                Webhook(gym_id=bad.gym.id, url=slow.url, secret="whsec_AAAA") for _ in range(10)
            )
            session.add(Webhook(gym_id=good.gym.id, url=url, secret="whsec_AAAA"))
            session.flush()
            for world in worlds:
                queue_webhook_message(session, world.gym.id, "wall.published")
        with at_work(server, delivery(server)):
            wait_for(lambda: received and len(slow.requests) == 2)
            assert len(received) == 1
            slow.answer.set()
            wait_for(lambda: len(slow.requests) == 10)


def test_ten_messages_to_a_slow_host_hold_up_no_other_gym(
    worlds: tuple[World, World], slow: Slow
) -> None:
    server, services = worlds[0].server, (slow, Slow())
    services[1].answer.set()
    for world, service, number in zip(worlds, services, (10, 1), strict=True):
        answer = {"new_routes": True, "quiet_from": 0, "quiet_to": 0}
        assert server.ask("PUT", "/me/messages", world.people["member"], answer).is_success
        with server.database.writing() as session:
            for _ in range(number):
                _push_to(session, world, service.url)
    private = server.settings.model_copy(update={"webhooks_to_private": True})
    sending = MessageSender(private, server.database, server.outbox)
    with at_work(server, Task(PUSHES, sending.push)):
        wait_for(lambda: services[1].requests and len(slow.requests) == 2)
        slow.answer.set()
        wait_for(lambda: len(slow.requests) == 10)
    services[1].close()


def _push_to(session: Session, world: World, url: str) -> None:
    """Queue a message to a browser of the gym's member."""
    person = world.people["member"].id
    assert person is not None
    keys = Service.keys()
    target = PushAddress(person_id=person, endpoint=f"{url}{uuid4()}", **keys)
    session.add(target)
    session.flush()
    row = Message(
        id=uuid4(),
        person_id=person,
        gym_id=world.gym.id,
        kind="new_routes",
        subject=str(target.id),
        target=str(target.id),
        body={},
    )
    session.add(row)
    enqueue(session, PUSHES, str(row.id), gym=world.gym.id)
