"""Webhooks of publications and stripped routes: signed, retried, never into our own networks."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any
from uuid import UUID

import pytest
from gym.tests.hurried import at_work, forget_jobs, waiting
from gym.tests.running import wait_for
from gym.tests.worlds import Server, World, hold
from sqlalchemy import select

from walltopo_gym.errors import RequestError
from walltopo_gym.jobs.queue import Task
from walltopo_gym.outgoing import check_url
from walltopo_gym.webhooks.delivery import Delivery, record_failure
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.service import DELIVERY, queue_webhook_message, send


@contextmanager
def listener(*statuses: int) -> Iterator[tuple[str, list[tuple[dict[str, str], bytes]]]]:
    """A gym's own program: its address and the messages that it got. Answers with these in turn."""
    answer: list[tuple[dict[str, str], bytes]] = []
    answers = iter(statuses)

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["content-length"]))
            answer.append(({k.lower(): v for k, v in self.headers.items()}, body))
            self.send_response(next(answers, 200))
            self.send_header("location", "http://localhost/elsewhere")
            self.end_headers()

        def log_message(self, *_: Any) -> None: ...

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/hook?gym=1", answer
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def events(world: World) -> list[UUID]:
    with world.server.database.reading() as session:
        ours = select(WebhookEvent.id).join(Webhook).where(Webhook.gym_id == world.gym.id)
        return list(session.scalars(ours.order_by(WebhookEvent.created_at)))


def delivery(server: Server) -> Task:
    """Return what sends messages, into our own networks too."""
    settings = server.settings.model_copy(update={"webhooks_to_private": True})
    return Task(DELIVERY, Delivery(settings, server.database).deliver, record_failure)


def hooked(world: World, url: str) -> str:
    """The webhook's secret."""
    path = f"{world.path}/webhooks"
    made = world.server.ask("POST", path, world.owner, {"url": "https://example.com/"}).json()
    with world.server.database.writing() as session:
        session.get_one(Webhook, UUID(made["id"])).url = url
    secret: str = made["secret"]
    return secret


def test_changes_are_sent_signed_until_accepted(world: World) -> None:
    forget_jobs(world.server)
    with listener(500, 302) as (url, answer):
        secret = hooked(world, url)
        scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
        assert world.publish(scan, {"number": 1}, revision=7).status_code == 409
        assert events(world) == []  # nothing happened, no message
        assert waiting(world.server, DELIVERY.name) == []
        assert world.publish(scan, {"number": 1}).is_success
        (event,) = events(world)
        assert waiting(world.server, DELIVERY.name) == [(str(event),)]
        with at_work(world.server, delivery(world.server)):
            wait_for(lambda: not events(world))
        assert len(answer) == 3
    headers, body = answer[-1]
    assert json.loads(body)["type"] == "wall.published"
    assert json.loads(body)["data"] == {"wall": str(world.wall.id), "scan": str(scan)}
    key = base64.b64decode(secret.removeprefix("whsec_"))
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    right = base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()
    assert headers["webhook-signature"] == f"v1,{right}"
    assert {answer[0][0]["webhook-id"], headers["webhook-id"]} == {str(event)}


@pytest.mark.parametrize(
    "url",
    [
        "http://example.com/",
        "https://127.0.0.1/",
        "https://10.0.0.7/x",
        "https://[::1]/",
        "https://169.254.169.254/latest/meta-data",
        "https://[::ffff:192.168.0.1]/",
        "https://[64:ff9b::10.0.0.1]/",
        "https://[64:ff9b:1::a00:1]/",
        "https://[2002:7f00:1::]/",
        "https://[::127.0.0.1]/",
        "https://[::ffff:0:192.168.0.1]/",
        "https://[2001:0:1::1]/",
        f"https://{'a' * 64}.example/",
        "https://a..example/",
        f"https://{'a.' * 130}example/",
        "https://user@example.com/",
        "ftp://example.com/",
        "https://[fd00::1]/",
        "https:///x",
    ],
)
def test_nothing_is_sent_into_our_own_networks(url: str) -> None:
    with pytest.raises(RequestError):
        check_url(url, private=False)


def test_a_name_that_means_ourselves_is_found_out_when_it_is_used() -> None:
    with listener() as (url, answer):
        port = int(url.rpartition(":")[2].partition("/")[0])
        check_url(f"https://localhost:{port}/", private=False)  # a name, not looked up yet
        with pytest.raises(RequestError, match="public"):
            send(f"https://localhost:{port}/", "whsec_", UUID(int=1), 0, {}, private=False)
        assert answer == []


def test_a_change_that_is_rolled_back_queues_nothing(world: World) -> None:
    forget_jobs(world.server)
    hooked(world, "https://example.com/")
    with world.server.database.writing() as session:
        queue_webhook_message(session, world.gym.id, "wall.published")
        session.rollback()
    assert events(world) == []
    assert waiting(world.server, DELIVERY.name) == []
