"""Messages: by choice, once, at the right hour, and unreadable for the push service."""

from __future__ import annotations

import json
import threading
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from uuid import UUID, uuid4
from zoneinfo import ZoneInfo

import http_ece
import pytest
from cryptography.hazmat.primitives.asymmetric.ec import (
    SECP256R1,
    EllipticCurvePublicKey,
    generate_private_key,
)
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from gym.tests.hurried import do_now, forget_jobs
from gym.tests.inspections.rounds import add_wall, begin, save_plan
from gym.tests.worlds import ORIGIN, Server, Somebody, World, hold, make_world
from hypothesis import given
from hypothesis import strategies as st
from py_vapid import Vapid02
from sqlalchemy import delete, select, update
from tests.at_once import at_once

from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.competitions.calendar import publish_beginnings
from walltopo_gym.competitions.models import Competition
from walltopo_gym.events import RoutesToForerun, publish_event
from walltopo_gym.gyms import days
from walltopo_gym.gyms.models import Gym
from walltopo_gym.inspections.due import publish_due
from walltopo_gym.inspections.models import Inspection, InspectionPlan
from walltopo_gym.jobs.queue import Task
from walltopo_gym.mail import Mail
from walltopo_gym.notifications import due, sending
from walltopo_gym.notifications.due import store_due_messages
from walltopo_gym.notifications.messages import MAILS, PUSHES
from walltopo_gym.notifications.models import Message, NotificationPreferences, PushAddress
from walltopo_gym.notifications.preferences import awake_at
from walltopo_gym.notifications.secrets import public_push_key, unsubscribe_token
from walltopo_gym.notifications.sending import MessageSender, record_failure
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.scans.models import Scan

pytestmark = pytest.mark.usefixtures("midday")

EVERYTHING = {
    "digest": True,
    "new_routes": True,
    "soon": True,
    "competitions": True,
    "hold_reports": True,
    "forerun": True,
    "inspections": True,
    "quiet_from": 0,
    "quiet_to": 0,
}


class Service:
    """A push service, and a browser that it knows."""

    def __init__(self) -> None:
        self.key, self.secret = generate_private_key(SECP256R1()), bytes(range(16))
        self.got: list[tuple[dict[str, str], bytes]] = []
        self.status = 201
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["content-length"]))
                outer.got.append(({k.lower(): v for k, v in self.headers.items()}, body))
                self.send_response(outer.status)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        self._http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.base = f"http://127.0.0.1:{self._http.server_port}"
        threading.Thread(target=self._http.serve_forever, daemon=True).start()

    @staticmethod
    def keys() -> dict[str, str]:
        """Return the push keys of a browser that nobody uses."""
        point = generate_private_key(SECP256R1()).public_key()
        encoded = point.public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
        return {
            "public_key": urlsafe_b64encode(encoded).decode().rstrip("="),
            "secret": urlsafe_b64encode(bytes(16)).decode().rstrip("="),
        }

    def subscription(self) -> dict[str, str]:
        point = self.key.public_key().public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
        return {
            "endpoint": f"{self.base}/{uuid4()}",
            "public_key": urlsafe_b64encode(point).decode().rstrip("="),
            "secret": urlsafe_b64encode(self.secret).decode().rstrip("="),
        }

    def read(self) -> list[dict[str, Any]]:
        """Return what the browser reads of what came."""
        return [
            json.loads(http_ece.decrypt(body, private_key=self.key, auth_secret=self.secret))
            for _, body in self.got
        ]

    def close(self) -> None:
        self._http.shutdown()
        self._http.server_close()


@pytest.fixture
def service() -> Iterator[Service]:
    made = Service()
    yield made
    made.close()


@pytest.fixture
def open_server(server: Server) -> Iterator[Server]:
    """One that sends into its own network."""
    before = server.settings
    server.settings = before.model_copy(update={"webhooks_to_private": True})
    object.__setattr__(server.services, "settings", server.settings)
    yield server
    server.settings = before
    object.__setattr__(server.services, "settings", before)


@pytest.fixture
def gym(open_server: Server) -> World:
    """A gym in which nobody else's preferences are due."""
    forget_jobs(open_server)
    with open_server.database.writing() as session:
        for kind in (Message, PushAddress, NotificationPreferences):
            session.execute(delete(kind))
    world = make_world(open_server, visibility="public")
    scan = world.reviewed({1: [1], 2: [2]}, [hold(1, 0.0, 1.0), hold(2, 1.0, 1.0)])
    rows = [{"number": n, "name": f"Moon {n}", "setter": "Jana"} for n in (1, 2)]
    assert world.publish(scan, *rows).is_success
    return world


def wish(world: World, who: Somebody, service: Service | None = None, **other: object) -> None:
    ask = world.server.ask
    assert ask("PUT", "/me/messages", who, EVERYTHING | other).is_success
    if service is not None:
        answer = ask("PUT", "/me/push", who, service.subscription())
        assert answer.status_code == 200, answer.text


def at(monkeypatch: pytest.MonkeyPatch, moment: datetime) -> None:
    for room in (due, sending, days):
        monkeypatch.setattr(room, "now", lambda: moment)


def tasks(server: Server) -> list[Task]:
    """Return what sends messages."""
    worker = MessageSender(server.settings, server.database, server.outbox)
    return [Task(MAILS, worker.mail, record_failure), Task(PUSHES, worker.push, record_failure)]


def note(world: World) -> None:
    publish_beginnings(world.server.database)
    store_due_messages(world.server.database)


def run(world: World) -> None:
    """A worker's round."""
    note(world)
    do_now(world.server, *tasks(world.server))


def letters_to(world: World, who: Somebody) -> list[Mail]:
    return [letter for letter in world.server.outbox.mails if letter.to == who.email]


def backdate(world: World, ago: timedelta) -> None:
    """The publication was so long ago."""
    with world.server.database.writing() as session:
        walls = Scan.wall_id == world.wall.id
        session.execute(update(Scan).where(walls).values(published_at=now() - ago))


def test_messages_are_opt_in(gym: World) -> None:
    backdate(gym, timedelta(minutes=30))
    run(gym)
    with gym.server.database.reading() as session:
        assert session.scalars(select(Message)).all() == []


def test_new_routes_arrive_once_and_encrypted(gym: World, service: Service) -> None:
    member = gym.people["member"]
    wish(gym, member, service, language="de")
    run(gym)
    assert service.got == []  # more walls may follow
    backdate(gym, timedelta(minutes=30))
    run(gym)
    run(gym)
    (answer,) = service.read()
    assert answer["title"] == f"{gym.gym.name}: Neue Routen: 2"
    assert (answer["text"], answer["path"]) == ("Cave", f"/g/{gym.gym.slug}")
    headers, body = service.got[0]
    assert b"Neue" not in body
    assert headers["content-encoding"] == "aes128gcm"
    # The service knows who sends: this server's key, for this service, for some hours.
    token, key = (part.partition("=")[2] for part in headers["authorization"][6:].split(","))
    assert key == public_push_key(gym.server.database)
    point = urlsafe_b64decode(key + "=" * (-len(key) % 4))
    assert EllipticCurvePublicKey.from_encoded_point(SECP256R1(), point)
    assert Vapid02.verify(f"vapid t={token},k={key}")
    claims = json.loads(urlsafe_b64decode(token.split(".")[1] + "=="))
    assert (claims["aud"], claims["sub"]) == (service.base, "mailto:walltopo@walls.example.com")


def test_messages_come_without_the_screen_in_the_hall(gym: World, service: Service) -> None:
    """The screen is another feature: a gym without it still tells its setters of broken holds."""
    wish(gym, gym.people["setter"], service)
    ask = gym.server.ask
    assert ask("PATCH", gym.path, gym.owner, {"features_off": ["hall"]}).is_success
    body = {
        "wall_id": str(gym.wall.id),
        "scan_id": gym.published()["scan_id"],
        "hold": 1,
        "kind": "spins",
    }
    path = f"{gym.path}/hold-reports/{uuid4()}"
    assert ask("PUT", path, gym.people["member"], body).is_success
    backdate(gym, timedelta(minutes=30))
    run(gym)
    titles = [answer["title"] for answer in service.read()]
    assert titles == ["Hold to check", f"{gym.gym.name}: New routes: 2"]


def test_two_workers_at_once_tell_once(gym: World, service: Service) -> None:
    wish(gym, gym.people["member"], service)
    backdate(gym, timedelta(minutes=30))
    at_once(*4 * [lambda: note(gym)])
    run(gym)
    assert len(service.got) == 1


def test_what_was_not_taken_is_tried_again(gym: World, service: Service) -> None:
    wish(gym, gym.people["member"], service)
    backdate(gym, timedelta(minutes=30))
    service.status = 500
    run(gym)
    assert len(service.got) == 1
    service.status = 201
    run(gym)
    run(gym)
    assert len(service.got) == 2


def test_a_browser_that_is_gone_goes(gym: World, service: Service) -> None:
    member = gym.people["member"]
    wish(gym, member, service)
    backdate(gym, timedelta(minutes=30))
    service.status = 410
    run(gym)
    assert gym.server.ask("GET", "/me/messages", member).json()["browsers"] == []


def test_a_project_that_goes_soon(gym: World, service: Service) -> None:
    done, working = gym.people["judge"], gym.people["member"]
    route = gym.published()["routes"][0]
    day = {"strip_on": str(now().date() + timedelta(days=2))}
    path = f"{gym.path}/routes/{route['id']}"
    assert gym.server.ask("PATCH", path, gym.people["setter"], day).is_success
    for who, kinds in ((done, ("project", "top")), (working, ("project", "try"))):
        wish(gym, who, service, new_routes=False)
        with gym.server.database.writing() as session:
            for kind in kinds:
                session.add(
                    Ascent(
                        person_id=who.id,
                        gym_id=gym.gym.id,
                        route_id=UUID(route["id"]),
                        gym_name="",
                        route_name="",
                        grade="",
                        kind=kind,
                        tries=1,
                        climbed_at=now(),
                    )
                )
    run(gym)
    run(gym)
    (answer,) = service.read()
    assert answer["path"].endswith(f"/r/{route['id']}")
    assert answer["text"].startswith("Moon")


def test_a_competition_that_one_has_entered(gym: World, service: Service) -> None:
    member = gym.people["member"]
    wish(gym, member, service, new_routes=False)
    wish(gym, gym.people["judge"], service, new_routes=False)
    body = {
        "name": "Spring Cup",
        "format": "festival",
        "self_entry": True,
        "starts_at": (now() + timedelta(hours=5)).isoformat(),
        "categories": [{"name": "All"}],
        "rounds": [{"name": "One", "kind": "open", "scoring": {"rules": "points"}}],
    }
    ask, setter = gym.server.ask, gym.people["setter"]
    made = ask("POST", f"{gym.path}/competitions", setter, body)
    assert made.status_code == 201, made.text
    path = f"{gym.path}/competitions/{made.json()['id']}"
    opened = ask("PUT", f"{path}/state", setter, {"state": "open"})
    assert opened.is_success, opened.text
    entry = {"category_id": made.json()["categories"][0]["id"], "waiver": ""}
    entered = ask("PUT", f"{path}/mine", member, entry)
    assert entered.is_success, entered.text
    run(gym)
    run(gym)
    (answer,) = service.read()
    assert answer["title"] == "Spring Cup starts soon"
    dates = ask("GET", f"{gym.path}/screen").json()["dates"]
    assert [(each["kind"], each["name"]) for each in dates] == [("competition", "Spring Cup")]
    with gym.server.database.writing() as session:
        session.execute(delete(Competition).where(Competition.gym_id == gym.gym.id))


def next_monday() -> datetime:
    """Return a moment of the Monday after a route that is published now."""
    return now() + timedelta(days=7 - now().weekday())


def test_the_weeks_mail(gym: World, monkeypatch: pytest.MonkeyPatch) -> None:
    member = gym.people["member"]
    wish(gym, member, language="fr")
    with gym.server.database.writing() as session:
        session.get_one(Gym, gym.gym.id).time_zone = "Europe/Prague"
    monday = next_monday().replace(hour=6, minute=30)
    before = monday.astimezone(ZoneInfo("Europe/Prague")).replace(hour=7, minute=59)
    at(monkeypatch, before.astimezone(UTC))
    run(gym)
    assert letters_to(gym, member) == []
    at(monkeypatch, before.astimezone(UTC) + timedelta(minutes=2))
    at_once(*3 * [lambda: note(gym)])
    run(gym)
    (letter,) = letters_to(gym, member)
    assert letter.subject == f"{gym.gym.name}\u202f: résumé de la semaine"
    assert "Moon 1, Jana" in letter.text
    assert f"{ORIGIN}/g/{gym.gym.slug}" in letter.text
    # One press in the mail program, signed in nowhere (RFC 8058), ends it.
    link = letter.headers["List-Unsubscribe"].strip("<>")
    assert letter.headers["List-Unsubscribe-Post"] == "List-Unsubscribe=One-Click"
    client = gym.server.client()
    gone = client.post(
        link,
        content=b"List-Unsubscribe=One-Click",
        headers={"content-type": "application/x-www-form-urlencoded"},
    )
    assert gone.status_code == 204, gone.text
    assert gym.server.ask("GET", "/me/messages", member).json()["digest"] is False
    assert gym.server.ask("GET", "/me/messages", member).json()["new_routes"] is True


def test_the_weeks_summary_by_push(
    gym: World, service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    member = gym.people["member"]
    wish(gym, member, service, digest_by="push", new_routes=False)
    at(monkeypatch, next_monday().replace(hour=12))
    run(gym)
    run(gym)
    (answer,) = service.read()
    assert answer["title"] == f"{gym.gym.name}: weekly summary"
    assert (answer["text"], answer["path"]) == ("New routes: 2", f"/g/{gym.gym.slug}")
    assert letters_to(gym, member) == []


def test_a_week_without_news_sends_no_summary(
    gym: World, service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    wish(gym, gym.people["member"], service, digest_by="push")
    wish(gym, gym.people["judge"])
    monday = next_monday() + timedelta(days=14)
    at(monkeypatch, monday.replace(hour=12))
    run(gym)
    assert service.got == []
    assert letters_to(gym, gym.people["judge"]) == []
    # Routes that come later that day wait for the next Monday.
    monkeypatch.setattr(due, "new_routes", lambda *_: gym_routes_of(gym))
    run(gym)
    assert service.got == []
    assert letters_to(gym, gym.people["judge"]) == []


def gym_routes_of(world: World) -> list[Route]:
    with world.server.database.reading() as session:
        return [route for route, _ in gym_routes(session, world.gym.id)]


def test_preferences_say_whether_somebody_has_chosen(gym: World) -> None:
    ask, member = gym.server.ask, gym.people["member"]
    before = ask("GET", "/me/messages", member).json()
    assert (before["chosen"], before["digest"]) == (False, False)
    assert ask("PUT", "/me/messages", member, {"digest": False}).is_success
    assert ask("GET", "/me/messages", member).json()["chosen"] is True


def test_forerunners_hear_once_that_their_routes_are_set(gym: World, service: Service) -> None:
    member = gym.people["member"]
    wish(gym, member, service)
    wish(gym, gym.people["judge"], service)  # no forerunner
    assert member.id is not None
    plan, day, forerunners = uuid4(), gym.gym.today(), frozenset({member.id})

    def answers(about: UUID) -> list[dict[str, Any]]:
        with gym.server.database.writing() as session:
            publish_event(
                session, RoutesToForerun(gym.gym.id, gym.wall.id, about, day, forerunners)
            )
        run(gym)
        return service.read()

    (answer,) = answers(plan)
    assert answer["title"] == "Routes to forerun"
    assert answer["text"].startswith(f"{gym.gym.name}, Cave, ")
    assert answer["path"] == f"/g/{gym.gym.slug}/desk/{plan}/forerun"
    assert len(answers(plan)) == 1
    wish(gym, member, forerun=False)  # not wanted any more: another plan sends nothing
    assert len(answers(uuid4())) == 1


def test_the_mails_link_turns_messages_off_and_on(gym: World) -> None:
    member = gym.people["member"]
    assert member.id is not None
    wish(gym, member)
    before = gym.server.ask("GET", "/me/messages", member).json()
    kinds = [
        "digest",
        "new_routes",
        "soon",
        "competitions",
        "hold_reports",
        "forerun",
        "inspections",
    ]
    path = f"/unsubscribe/{unsubscribe_token(gym.server.database, member.id)}"
    answer = gym.server.ask("GET", path).json()
    assert answer == {kind: before[kind] for kind in kinds}
    none = dict.fromkeys(kinds, False)
    for wanted in (none, answer):
        assert gym.server.ask("PUT", path, json=wanted).status_code == 204
        assert gym.server.ask("GET", path).json() == wanted
    # The link changes nothing else.
    assert gym.server.ask("GET", "/me/messages", member).json() == before
    # A person without preferences gets no messages, and can turn them on.
    judge = gym.people["judge"]
    assert judge.id is not None
    path = f"/unsubscribe/{unsubscribe_token(gym.server.database, judge.id)}"
    assert gym.server.ask("GET", path).json() == none
    assert gym.server.ask("PUT", path, json=none).status_code == 204


def test_a_link_of_another_ends_nothing(gym: World) -> None:
    one, other = gym.people["member"].id, gym.people["judge"].id
    assert one is not None
    assert other is not None
    tokens = [unsubscribe_token(gym.server.database, person) for person in (one, other)]
    mixed = tokens[0][:22] + tokens[1][22:]
    for token in (mixed, "x", "a" * 43, tokens[0][:-2]):
        for method, body in (("POST", None), ("GET", None), ("PUT", {"digest": True})):
            assert gym.server.ask(method, f"/unsubscribe/{token}", json=body).status_code == 404


def test_a_mail_that_was_not_taken_is_tried_again(
    gym: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    wish(gym, gym.people["member"])
    monday = next_monday()
    at(monkeypatch, monday.replace(hour=9, minute=0))
    tried: list[Mail] = []

    def refuse(letter: Mail) -> None:
        tried.append(letter)
        raise OSError("away")

    monkeypatch.setattr(gym.server.outbox, "hand_over", refuse)
    run(gym)
    at(monkeypatch, monday.replace(hour=9, minute=5))
    run(gym)
    assert len(tried) == 2
    assert tried[0].headers["Message-ID"] == tried[1].headers["Message-ID"]


def test_a_trial_says_whether_it_arrives(gym: World, service: Service) -> None:
    member = gym.people["member"]
    wish(gym, member, service, language="cs")
    browser = gym.server.ask("GET", "/me/messages", member).json()["browsers"][0]["id"]
    path = f"/me/push/{browser}/trial"
    assert gym.server.ask("POST", path, member).status_code == 204
    assert service.read()[0]["title"] == "Zkušební oznámení"
    service.status = 503
    assert gym.server.ask("POST", path, member).json()["code"] == "push-not-taken"


def test_keys_that_are_none_are_refused(gym: World, service: Service) -> None:
    for other in ({"secret": "AAAA"}, {"public_key": "B" * 87}, {"public_key": "A"}):
        answer = gym.server.ask("PUT", "/me/push", gym.owner, service.subscription() | other)
        assert (answer.status_code, answer.json()["code"]) == (422, "push-keys-wrong")


MOMENTS = st.datetimes(datetime(2026, 1, 1), datetime(2027, 1, 1)).map(
    lambda at: at.replace(tzinfo=UTC)
)


@given(MOMENTS, st.integers(0, 23), st.integers(0, 23))
def test_the_quiet_hours_are_quiet(moment: datetime, begin: int, end: int) -> None:
    zone = ZoneInfo("Europe/Prague")
    preferences = NotificationPreferences(quiet_from=begin, quiet_to=end)
    awake = awake_at(preferences, moment, zone)

    def is_quiet(hour: int) -> bool:
        return begin <= hour < end if begin <= end else hour >= begin or hour < end

    hour = moment.astimezone(zone).hour
    if not is_quiet(hour):
        assert awake == moment
    else:
        assert awake > moment
        assert awake - moment <= timedelta(hours=25)
        assert awake.astimezone(zone).hour in (end, (end + 1) % 24)  # where the clock leaps


def test_a_hold_report_reaches_setters_and_its_end_the_reporter(
    gym: World, service: Service
) -> None:
    setter, member = gym.people["setter"], gym.people["member"]
    wish(gym, setter, service, language="de", new_routes=False)
    scan, path = gym.published()["scan_id"], f"{gym.path}/hold-reports/{uuid4()}"
    body = {"wall_id": str(gym.wall.id), "scan_id": scan, "hold": 1, "kind": "spins"}
    assert gym.server.ask("PUT", path, member, body).is_success
    run(gym)
    run(gym)
    (answer,) = service.read()
    assert (answer["title"], answer["text"]) == ("Griff prüfen", "Dreht sich, Moon 1, Cave")
    assert answer["path"] == f"/g/{gym.gym.slug}/w/{gym.wall.id}/holds"
    # A reporter gets the end of the report, and nothing of other reports.
    wish(gym, member, service, new_routes=False)
    run(gym)
    assert len(service.got) == 1
    assert gym.server.ask("PUT", f"{path}/done", setter).is_success
    run(gym)
    run(gym)
    assert [each["title"] for each in service.read()[1:]] == ["Your hold report is done"]


def test_setters_hear_once_that_an_inspection_is_due(gym: World, service: Service) -> None:
    setter = gym.people["setter"]
    wish(gym, setter, service)
    wish(gym, gym.people["member"], service)  # no setter
    save_plan(gym, operational=None, annual=None)
    for _ in range(2):
        publish_due(gym.server.database)
        run(gym)
    (answer,) = service.read()
    assert answer["title"] == "Inspection due: routine visual"
    assert answer["text"] == f"{gym.gym.name}: {gym.wall.name}"
    assert answer["path"] == f"/g/{gym.gym.slug}/inspections"
    begin(gym).finish()
    publish_due(gym.server.database)
    run(gym)
    assert len(service.read()) == 1


def test_setters_hear_of_another_wall_while_one_is_overdue(gym: World, service: Service) -> None:
    wish(gym, gym.people["setter"], service)
    save_plan(gym, visual=1, operational=None, annual=None)
    begin(gym).finish()
    add_wall(gym, "Attic")
    with gym.server.database.writing() as session:
        plans = update(InspectionPlan).where(InspectionPlan.gym_id == gym.gym.id)
        session.execute(plans.values(created_at=now() - timedelta(days=9)))
    publish_due(gym.server.database)
    run(gym)
    assert [each["text"] for each in service.read()] == [f"{gym.gym.name}: Attic"]
    with gym.server.database.writing() as session:
        made = update(Inspection).where(Inspection.gym_id == gym.gym.id)
        session.execute(made.values(finished_at=now() - timedelta(days=2)))
    for _ in range(2):
        publish_due(gym.server.database)
        run(gym)
    texts = [each["text"] for each in service.read()]
    assert texts[1:] == [f"{gym.gym.name}: Attic, {gym.wall.name}"]
