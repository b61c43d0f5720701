"""Webhooks of publications and stripped routes: signed, retried, never into our own networks."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.competitions.contest import Contest
from gym.tests.hurried import at_work, do_all, forget_jobs, waiting
from gym.tests.running import wait_for
from gym.tests.worlds import Server, World, hold
from sqlalchemy import select

from walltopo_gym.clock import now
from walltopo_gym.errors import RequestError
from walltopo_gym.events import CompetitionBegins, publish_event
from walltopo_gym.jobs.queue import Failure, Task
from walltopo_gym.outgoing import check_url
from walltopo_gym.scans.queues import scan_finished
from walltopo_gym.scans.service import State
from walltopo_gym.scans.worker import record_failure as record_scan_failure
from walltopo_gym.webhooks.delivery import Delivery, record_failure
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.service import (
    COUNTS,
    DELIVERY,
    count_ascents,
    note_delivery,
    queue_webhook_message,
    send,
)


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
    """The gym's messages that are not delivered yet."""
    with world.server.database.reading() as session:
        ours = select(WebhookEvent.id).join(Webhook).where(Webhook.gym_id == world.gym.id)
        ours = ours.where(WebhookEvent.delivered_at.is_(None))
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


def bodies(world: World) -> list[dict[str, Any]]:
    """The gym's messages, the oldest first."""
    with world.server.database.reading() as session:
        ours = select(WebhookEvent.body).join(Webhook).where(Webhook.gym_id == world.gym.id)
        return list(session.scalars(ours.order_by(WebhookEvent.created_at)))


def test_a_message_is_sent_again_with_its_id(world: World) -> None:
    forget_jobs(world.server)
    server = world.server
    with listener() as (url, answer):
        hooked(world, url)
        with server.database.writing() as session:
            queue_webhook_message(session, world.gym.id, "wall.published", wall="w")
        do_all(server, delivery(server))
        (hook,) = server.ask("GET", f"{world.path}/webhooks", world.owner).json()
        (message,) = hook["deliveries"]
        assert message["delivered_at"] is not None
        assert (hook["waiting"], hook["error"]) == (0, "")
        path = f"{world.path}/webhooks/{hook['id']}/deliveries/{message['id']}/replay"
        # Two clicks are one more delivery.
        answers = [server.ask("POST", path, world.owner).status_code for _ in range(2)]
        assert answers == [204, 409]
        (hook,) = server.ask("GET", f"{world.path}/webhooks", world.owner).json()
        assert hook["waiting"] == 1
        do_all(server, delivery(server))
    ids = [headers["webhook-id"] for headers, _ in answer]
    assert ids == [message["id"]] * 2
    assert answer[0][1] == answer[1][1]


def test_a_message_of_another_webhook_is_not_there(world: World) -> None:
    hooked(world, "https://example.com/a")
    hooked(world, "https://example.com/b")
    with world.server.database.writing() as session:
        queue_webhook_message(session, world.gym.id, "wall.published")
    hooks = world.server.ask("GET", f"{world.path}/webhooks", world.owner).json()
    message = hooks[0]["deliveries"][0]["id"]
    path = f"{world.path}/webhooks/{hooks[1]['id']}/deliveries/{message}/replay"
    assert world.server.ask("POST", path, world.owner).json()["code"] == "not-there-delivery"


def test_delivered_messages_go_after_some_days(world: World) -> None:
    hooked(world, "https://example.com/")
    with world.server.database.writing() as session:
        for _ in range(3):
            queue_webhook_message(session, world.gym.id, "wall.published")
    old, new, waits = events(world)
    with world.server.database.writing() as session:
        webhook = session.get_one(WebhookEvent, old).webhook_id
        session.get_one(WebhookEvent, old).delivered_at = now() - timedelta(days=8)
        note_delivery(session, new, webhook)
    with world.server.database.reading() as session:
        ours = select(WebhookEvent.id).where(WebhookEvent.webhook_id == webhook)
        assert set(session.scalars(ours)) == {new, waits}


def climb(world: World, who: str, kind: str = "top") -> UUID:
    route = world.published()["routes"][0]["id"]
    body = {"route_id": route, "kind": kind, "climbed_at": now().isoformat(), "tries": 1}
    ascent = uuid4()
    path = f"{world.path}/ascents/{ascent}"
    assert world.server.ask("PUT", path, world.people[who], body).is_success
    return ascent


def test_ascents_come_as_counts_of_a_route_once_in_a_while(world: World) -> None:
    forget_jobs(world.server)
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1}).is_success
    climb(world, "judge")
    assert waiting(world.server, COUNTS.name) == []  # nobody listens
    hooked(world, "https://example.com/")
    for who, kind in (("member", "flash"), ("judge", "top"), ("setter", "try")):
        climb(world, who, kind)
    (job,) = waiting(world.server, COUNTS.name)
    for _ in range(2):  # a killed worker's job is repeated
        count_ascents(world.server.database, *job)
    (body,) = bodies(world)
    assert body["type"] == "ascents.counted"
    route = world.published()["routes"][0]["id"]
    counts = {"ascents": {"flash": 1, "top": 2, "try": 1}, "climbers": 2}
    assert body["data"] == {"routes": [{"wall": str(world.wall.id), "route": route} | counts]}
    assert not any(str(one.id) in json.dumps(body) for one in world.people.values() if one.id)


def test_a_correction_and_a_withdrawal_are_counted_too(world: World) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1}).is_success
    ascent, member = climb(world, "member"), world.people["member"]
    hooked(world, "https://example.com/")
    for method, body in (("PATCH", {"kind": "try"}), ("DELETE", None)):
        forget_jobs(world.server)
        answer = world.server.ask(method, f"/me/ascents/{ascent}", member, body)
        assert answer.is_success, answer.text
        assert len(waiting(world.server, COUNTS.name)) == 1


def test_a_scan_tells_of_its_end(world: World) -> None:
    hooked(world, "https://example.com/")
    for failed in (False, True):
        scan = world.scan(State.RUNNING)
        with world.server.database.writing() as session:
            scan_finished(session, scan, failed=failed)
    scan = world.scan(State.QUEUED)
    with world.server.database.writing() as session:
        record_scan_failure(session, Failure("killed", "killed", 1, None), str(scan), 0)
    kinds = [body["type"] for body in bodies(world)]
    assert kinds == ["scan.finished", "scan.failed", "scan.failed"]
    assert bodies(world)[-1]["data"] == {"wall": str(world.wall.id), "scan": str(scan)}


def test_a_competition_says_how_it_goes_on(world: World) -> None:
    hooked(world, "https://example.com/")
    contest = Contest(world).make()
    for state in ("open", "open", "running", "ended"):
        contest.move(state)
    kinds = [body["type"].removeprefix("competition.") for body in bodies(world)]
    assert kinds == ["published", "started", "ended"]
    assert {body["data"]["competition"] for body in bodies(world)} == {contest.sheet["id"]}


def test_a_competition_is_announced_once(world: World) -> None:
    hooked(world, "https://example.com/")
    competition, at = uuid4(), now()
    event = CompetitionBegins(world.gym.id, competition, "Cup", at, frozenset({uuid4()}))
    for _ in range(2):  # it is published several times
        with world.server.database.writing() as session:
            publish_event(session, event)
    (body,) = bodies(world)
    assert body["type"] == "competition.begins"
    assert body["data"] == {"competition": str(competition), "at": at.isoformat()}
