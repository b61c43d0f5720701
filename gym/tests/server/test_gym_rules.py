"""Each endpoint of the OpenAPI document × each kind of person × a gym they may see or not.

The table below is this file's own: it repeats who may do what, and by which request. An
endpoint that is not in it fails, and so does one that lets in whom the table does not.
"""

from __future__ import annotations

from base64 import urlsafe_b64encode
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import timedelta
from io import BytesIO
from typing import Any
from uuid import UUID, uuid4

import httpx
import pytest
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from gym.tests.authenticator import Device
from gym.tests.clips.attempts import an_attempt
from gym.tests.competitions import cases as cups
from gym.tests.inspections.rounds import InspectionOf, begin, photo
from gym.tests.publishing.test_gym_moves import ENTRIES, reviewed
from gym.tests.worlds import ORIGIN, PASSWORD, Server, Somebody, World, hold, make_world
from PIL import Image
from sqlalchemy import func, select

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.mails import new_link
from walltopo_gym.accounts.models import AppConnection, AuditEntry, SignIn
from walltopo_gym.announcements.service import make_announcement
from walltopo_gym.climbing.models import Follow
from walltopo_gym.clips.models import Clip
from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Entry, Round
from walltopo_gym.gyms.members import add_member, invite
from walltopo_gym.gyms.models import Ban, GradeSystem, Invitation
from walltopo_gym.gyms.roles import Role
from walltopo_gym.hold_changes.models import HoldChange, HoldComparison
from walltopo_gym.insights.models import Washing
from walltopo_gym.notifications.models import PushAddress
from walltopo_gym.notifications.secrets import unsubscribe_token
from walltopo_gym.publishing.codes import code_of
from walltopo_gym.publishing.moves import SuggestedMoves
from walltopo_gym.scans.service import State
from walltopo_gym.walls.models import RopeLine, Wall
from walltopo_gym.webhooks.models import WebhookEvent

ROLES = ("guest", "member", "judge", "setter", "owner")
PEOPLE = ("nobody", "stranger", "operator", "member", "judge", "setter", "owner")


def a_new_line(world: World) -> dict[str, Any]:
    return {"wall": world.wall.id, "line": uuid4()}


def a_lines_body(world: World) -> dict[str, Any]:
    return {"label": "7", "belays": ["lead"]}


def a_line(world: World) -> dict[str, Any]:
    row = RopeLine(wall_id=world.wall.id, label="7", belays=["lead"], points=[])
    with world.server.database.writing() as session:
        session.add(row)
    return {"wall": world.wall.id, "line": row.id}


def no_values(world: World) -> dict[str, Any]:
    """The path names nothing below the gym."""
    return {}


@dataclass(frozen=True)
class Case:
    """How an endpoint is used, and by whom.

    Parameters
    ----------
    who : "anyone", "judge-link" (everybody with its cookie), "signed-in", "operator", or the least
        role in the gym ("guest": everybody who sees it).
    scope : what a token needs; None: no token will do.
    values : of the path, made anew for each request; body, query : likewise.
    known : a guest must be signed in. cookie : what the browser has beside its sign-in.
    """

    who: str
    scope: Scope | None = None
    values: Callable[[World], dict[str, Any]] = no_values
    body: Callable[[World], object] = lambda world: None
    known: bool = False
    headers: dict[str, str] = field(default_factory=dict)
    content: bytes | None = None
    query: Callable[[World], str] = lambda world: ""
    cookie: Callable[[World], str] = lambda world: ""


def _invitation(world: World) -> str:
    owner = world.owner.id
    assert owner is not None
    with world.server.database.writing() as session:
        return invite(session, world.gym.id, Role.MEMBER, 1, 1, owner)


def _row_of(kind: Any) -> Callable[[World], dict[str, Any]]:
    name = {"GradeSystem": "system", "Invitation": "invitation"}[kind.__name__]

    def values(world: World) -> dict[str, Any]:
        if kind is Invitation:
            _invitation(world)
        with world.server.database.reading() as session:
            return {
                name: session.scalars(select(kind.id).where(kind.gym_id == world.gym.id)).first()
            }

    return values


def _mailed(kind: Any) -> Callable[[World], str]:
    def secret(world: World) -> str:
        email = world.server.person().email if kind == "reset" else f"{world.gym.slug}@example.com"
        with world.server.database.writing() as session:
            return new_link(session, kind, email)

    return secret


def _token(world: World) -> dict[str, Any]:
    made = world.server.ask("POST", "/me/tokens", world.owner, {"name": "t", "scopes": ["read"]})
    return {"token": made.json()["id"]}


def _app_body(world: World) -> dict[str, Any]:
    return {
        "name": "Log",
        "home_page": "https://log.example/",
        "redirects": ["https://log.example/done"],
        "confidential": True,
    }


def _plain_app_body(world: World) -> dict[str, Any]:
    return {name: value for name, value in _app_body(world).items() if name != "confidential"}


def _an_app(world: World) -> dict[str, Any]:
    made = world.server.ask("POST", "/me/apps", world.owner, _app_body(world))
    assert made.is_success, made.text
    return {"app": made.json()["id"]}


def _authorization_body(world: World) -> dict[str, Any]:
    query = f"client_id={_an_app(world)['app']}&response_type=code&code_challenge={'x' * 43}"
    return {"query": f"?{query}&code_challenge_method=S256&scope=read"}


def _a_connection(world: World) -> dict[str, Any]:
    body = _authorization_body(world)
    made = world.server.ask("POST", "/me/authorizations", world.owner, body)
    assert made.is_success, made.text
    mine = select(AppConnection.id).where(AppConnection.person_id == world.owner.id)
    with world.server.database.reading() as session:
        return {"connection": session.scalars(mine).first()}


def _a_delivery(world: World) -> dict[str, Any]:
    body = {"url": "https://example.com/"}
    made = world.server.ask("POST", f"{world.path}/webhooks", world.owner, body).json()
    facts = {"body": {"type": "wall.published"}, "delivered_at": now()}
    message = WebhookEvent(webhook_id=UUID(made["id"]), **facts)
    with world.server.database.writing() as session:
        session.add(message)
        session.flush()
        return {"webhook": made["id"], "delivery": message.id}


def wall(world: World) -> dict[str, Any]:
    return {"wall": world.wall.id}


def member(world: World) -> dict[str, Any]:
    return {"person": world.people["member"].id}


def an_announcement(world: World) -> dict[str, Any]:
    with world.server.database.writing() as session:
        row = make_announcement(session, {"en": "Closed on Monday"}, None, None, None)
        return {"announcement": row.id}


def a_members_address(world: World) -> dict[str, Any]:
    return {"email": world.people["member"].email}


def a_mails_link(world: World) -> dict[str, Any]:
    return {"token": unsubscribe_token(world.server.database, person_id(world.owner))}


def a_scan(world: World) -> dict[str, Any]:
    return {"scan": world.scan(usable=3)}


def a_queued_scan(world: World) -> dict[str, Any]:
    return {"scan": world.scan(State.QUEUED)}


def a_photo(world: World) -> dict[str, Any]:
    return {"photo": world.photo(world.scan(), size=5)}


def a_seen_photo(world: World) -> dict[str, Any]:
    photo = world.photo(world.scan(), state="usable", width=4, sha256="ab" * 32)
    world.server.services.store.put(f"thumbnails/{'ab' * 32}.jpg", b"picture")
    return {"photo": photo}


def a_draft(world: World) -> dict[str, Any]:
    return {"scan": world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])}


def _a_model(world: World) -> dict[str, Any]:
    """A draft with the poses of two photos that show the origin from 3 m."""
    draft = a_draft(world)
    model = {
        "cameras.txt": "1 PINHOLE 640 480 500 500 320 240\n",
        "images.txt": "1 1 0 0 0 0 0 3 1 0001.jpg\n\n2 1 0 0 0 1 0 3 1 0002.jpg\n\n",
        "points3D.txt": "",
    }
    for name, text in model.items():
        world.server.services.store.put(f"scans/{draft['scan']}/sparse/{name}", text.encode())
    return draft


def _published(world: World, revision: int = 0) -> Any:
    scan = a_draft(world)["scan"]
    assert world.publish(scan, {"number": 1}, revision=revision).is_success
    return scan


def _former(world: World) -> Any:
    scan = _published(world)
    _published(world, revision=1)
    return scan


def a_published_wall(world: World) -> dict[str, Any]:
    _published(world)
    return wall(world)


def a_published_file(world: World) -> dict[str, Any]:
    return {"scan": _published(world), "path": "index.html"}


def _drawn(world: World) -> None:
    """A picture of the version that is published."""
    scan = _published(world)
    image = Image.new("I;16", (8, 4))
    image.putpixel((4, 2), 1)
    stream = BytesIO()
    image.save(stream, "PNG")
    for name in ("front", "holds"):
        world.server.services.store.put(f"pictures/{scan}/{name}.png", stream.getvalue())


def a_drawn_wall(world: World) -> dict[str, Any]:
    _drawn(world)
    return wall(world)


def a_drawn_route(world: World) -> dict[str, Any]:
    _drawn(world)
    return {"route": world.published()["routes"][0]["id"]}


def a_route(world: World) -> dict[str, Any]:
    _published(world)
    return {"route": world.published()["routes"][0]["id"]}


def a_route_with_moves(world: World) -> dict[str, Any]:
    scan = reviewed(world)
    assert world.publish(scan, *ENTRIES).is_success
    SuggestedMoves(world.server.database, world.server.services.store).suggest(str(scan))
    return {"route": world.published()["routes"][0]["id"]}


def a_hand_route(world: World) -> dict[str, Any]:
    path = f"{world.path}/walls/{world.wall.id}/routes"
    made = world.server.ask("POST", path, world.owner, {"routes": [{"name": "By hand"}]})
    return {"route": made.json()[0]["id"]}


def a_stripped_route(world: World) -> dict[str, Any]:
    values = a_hand_route(world)
    path = f"{world.path}/routes/{values['route']}/strip"
    assert world.server.ask("POST", path, world.owner).is_success
    return values


def an_ascent(world: World) -> dict[str, Any]:
    _published(world)
    return {"ascent": uuid4()}


def ascent_body(world: World) -> dict[str, Any]:
    return {
        "route_id": world.published()["routes"][0]["id"],
        "kind": "top",
        "tries": 2,
        "climbed_at": now().isoformat(),
    }


def a_new_other_ascent(world: World) -> dict[str, Any]:
    return {"ascent": uuid4()}


def other_ascent_body(world: World) -> object:
    return {"venue": "outdoors", "name": "Kauk", "kind": "onsight", "day": "2024-05-14"}


def an_other_ascent(world: World) -> dict[str, Any]:
    ascent = uuid4()
    path = f"/me/log/others/{ascent}"
    assert world.server.ask("PUT", path, world.owner, other_ascent_body(world)).is_success
    return {"ascent": ascent}


def an_own_ascent(world: World) -> dict[str, Any]:
    path, body = an_ascent(world)["ascent"], CASES["put_ascent"].body(world)
    made = world.server.ask("PUT", f"{world.path}/ascents/{path}", world.owner, body)
    return {"ascent": made.json()["id"]}


def a_comment(world: World) -> dict[str, Any]:
    values = a_route(world)
    path = f"{world.path}/routes/{values['route']}/opinion"
    comment = {"comment": "Rubbish"}
    assert world.server.ask("PUT", path, world.people["judge"], comment).is_success
    return values | {"person": world.people["judge"].id}


def a_report(world: World) -> dict[str, Any]:
    values = a_comment(world)
    path = f"{world.path}/routes/{values['route']}/comments/{values['person']}/report"
    assert world.server.ask("PUT", path, world.people["member"], {}).is_success
    reports = world.server.ask("GET", f"{world.path}/reports", world.owner).json()["items"]
    return {"report": reports[0]["id"]}


def _hold_report_body(world: World) -> dict[str, Any]:
    scan = world.published()["scan_id"]
    return {"wall_id": str(world.wall.id), "scan_id": scan, "hold": 1, "kind": "spins"}


def a_new_hold_report(world: World) -> dict[str, Any]:
    _published(world)
    return {"report": uuid4()}


def a_hold_report(world: World) -> dict[str, Any]:
    values = a_new_hold_report(world)
    path = f"{world.path}/hold-reports/{values['report']}"
    member = world.people["member"]
    assert world.server.ask("PUT", path, member, _hold_report_body(world)).is_success
    return values


def a_hold_change(world: World) -> dict[str, Any]:
    _published(world)
    row = HoldComparison(scan_id=UUID(world.published()["scan_id"]), since=now(), compared=1)
    change = HoldChange(scan_id=row.scan_id, hold=1, kind="turned", turn_deg=20.0, moved_m=0.0)
    with world.server.database.writing() as session:
        session.merge(row)
        session.flush()
        session.add(change)
    return {"change": change.id}


def _inspection(world: World) -> InspectionOf:
    _published(world)
    return begin(world)


def an_inspection(world: World) -> dict[str, Any]:
    return {"inspection": _inspection(world).id}


def an_ended_inspection(world: World) -> dict[str, Any]:
    made = _inspection(world)
    made.mark()
    assert made.finish(remarks="fine").is_success
    return {"inspection": made.id}


def an_inspection_entry(world: World) -> dict[str, Any]:
    return an_inspection(world) | {"entry": uuid4()}


def an_inspection_photo(world: World) -> dict[str, Any]:
    made = _inspection(world)
    name = made.send_photo(photo()).json()["photo"]
    return {"inspection": made.id, "photo": name}


def an_inspection_code(world: World) -> dict[str, Any]:
    made = _inspection(world)
    return {"code": made.finish().json()["code"]}


def a_hold(world: World) -> dict[str, Any]:
    _published(world)
    return wall(world) | {"scan": world.published()["scan_id"], "hold": 1}


def _plan_of_inspections(world: World) -> object:
    path = f"{world.path}/inspections/plan"
    return {"levels": world.server.ask("GET", path, world.owner).json()["levels"]}


def _problem_body(world: World, share: str = "gym") -> dict[str, Any]:
    holds = [{"hold": 1, "use": "start"}, {"hold": 2, "use": "top"}]
    scan = world.published()["scan_id"]
    return {
        "wall_id": str(world.wall.id),
        "scan_id": scan,
        "holds": holds,
        "name": "Mine",
        "share": share,
    }


def a_wall_for_problems(world: World) -> dict[str, Any]:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0), hold(2, 0.2, 2.0)])
    assert world.publish(scan, {"number": 1}).is_success
    return {"wall": world.wall.id}


def a_new_problem(world: World) -> dict[str, Any]:
    a_wall_for_problems(world)
    return {"problem": uuid4()}


def an_own_problem(world: World) -> dict[str, Any]:
    values = a_new_problem(world)
    path = f"{world.path}/problems/{values['problem']}"
    made = world.server.ask("PUT", path, world.owner, _problem_body(world))
    assert made.is_success, made.text
    return values


def a_problem(world: World) -> dict[str, Any]:
    values = a_new_problem(world)
    path = f"{world.path}/problems/{values['problem']}"
    made = world.server.ask("PUT", path, world.people["member"], _problem_body(world, "link"))
    assert made.is_success, made.text
    return values


def a_members_problem(world: World) -> dict[str, Any]:
    values = a_problem(world)
    path = f"{world.path}/problems/{values['problem']}"
    changed = world.server.ask("PUT", path, world.people["member"], _problem_body(world))
    assert changed.is_success, changed.text
    return values


def _list_body(world: World, share: str = "gym") -> dict[str, Any]:
    return {"name": "Warm-up", "share": share, "items": []}


def a_new_list(world: World) -> dict[str, Any]:
    return {"list_id": uuid4()}


def _a_list(world: World, who: str, share: str = "gym") -> dict[str, Any]:
    values = a_new_list(world)
    path = f"{world.path}/lists/{values['list_id']}"
    made = world.server.ask("PUT", path, world.people[who], _list_body(world, share))
    assert made.status_code == 201, made.text
    return values


def an_own_list(world: World) -> dict[str, Any]:
    return _a_list(world, "owner")


def a_linked_list(world: World) -> dict[str, Any]:
    return _a_list(world, "member", "link")


def a_members_list(world: World) -> dict[str, Any]:
    return _a_list(world, "member")


def a_route_to_film(world: World) -> dict[str, Any]:
    a_published_wall(world)
    rows = world.server.ask("GET", f"{world.path}/routes", world.owner).json()
    return {"route": rows[0]["id"]}


def an_own_clip(world: World) -> dict[str, Any]:
    """A clip of the owner that has an attempt, while its five bytes are still expected."""
    route = UUID(a_route_to_film(world)["route"])
    with world.server.database.writing() as session:
        scan = session.get_one(Wall, world.wall.id).published_scan_id
        assert scan is not None
        facts = {"route_id": route, "scan_id": scan, "size": 5, "state": "receiving"}
        row = Clip(person_id=person_id(world.owner), attempt=an_attempt(), holds=[1], **facts)
        session.add(row)
    return {"clip": row.id}


def a_film(world: World) -> dict[str, Any]:
    """A published film of the owner."""
    values = an_own_clip(world)
    with world.server.database.writing() as session:
        row = session.get_one(Clip, values["clip"])
        row.moves, row.confirmed_at = [{"limb": "left hand", "hold": 1, "time_s": 0.0}], now()
        row.film_size, row.published_at = 5, now()
    world.server.services.store.put(row.film, b"bytes")
    return values


def a_film_report(world: World) -> dict[str, Any]:
    path = f"{world.path}/clips/{a_film(world)['clip']}/film/report"
    assert world.server.ask("PUT", path, world.people["judge"], {}).is_success
    reports = world.server.ask("GET", f"{world.path}/film-reports", world.owner).json()["items"]
    return {"report": reports[0]["id"]}


def a_problem_report(world: World) -> dict[str, Any]:
    values = a_members_problem(world)
    path = f"{world.path}/problems/{values['problem']}/report"
    assert world.server.ask("PUT", path, world.people["judge"], {}).is_success
    reports = world.server.ask("GET", f"{world.path}/problem-reports", world.owner).json()["items"]
    return {"report": reports[0]["id"]}


def a_grade(world: World) -> dict[str, str]:
    with world.server.database.reading() as session:
        mine = select(GradeSystem).where(GradeSystem.gym_id == world.gym.id)
        system = session.scalars(mine.order_by(GradeSystem.name)).first()
    assert system is not None
    return {"grade_system_id": str(system.id), "grade": str(system.grades[0]["label"])}


def _reset_plan_body(world: World) -> dict[str, Any]:
    foreruns = [str(person_id(world.people[name])) for name in ("member", "judge")]
    return {"wall_id": str(world.wall.id), "day": "2026-01-05", "forerunners": foreruns}


def a_new_reset_plan(world: World) -> dict[str, Any]:
    return {"plan": uuid4()}


def a_reset_plan(world: World) -> dict[str, Any]:
    """Names the member and the judge as forerunners."""
    values = a_new_reset_plan(world)
    path = f"{world.path}/reset-plans/{values['plan']}"
    assert world.server.ask("PUT", path, world.owner, _reset_plan_body(world)).is_success
    return values


def a_route_to_forerun(world: World) -> dict[str, Any]:
    return a_reset_plan(world) | a_hand_route(world)


def a_banned_person(world: World) -> dict[str, Any]:
    person = world.server.person()
    assert person.id is not None
    with world.server.database.writing() as session:
        session.add(Ban(gym_id=world.gym.id, person_id=person.id, reason=""))
    return {"person": person.id}


def an_own_sign_in(world: World) -> dict[str, Any]:
    owner = world.owner.id
    assert owner is not None
    with world.server.database.writing() as session:
        row = SignIn(
            person_id=owner, token_hash=uuid4().hex, expires_at=now() + timedelta(days=36_500)
        )
        session.add(row)
    return {"sign_in": row.id}


def a_device_sign_in(world: World) -> dict[str, Any]:
    made = world.server.ask("POST", "/me/device-sign-ins", world.owner).json()
    return {"device_sign_in": made["id"]}


def _offered(world: World) -> str:
    link: str = world.server.ask("POST", "/me/device-sign-ins", world.server.person()).json()[
        "link"
    ]
    return link.partition("#")[2]


def _claimed(world: World) -> str:
    body = {"secret": _offered(world)}
    claim: str = world.server.ask("POST", "/session/device-sign-in/claim", json=body).json()[
        "claim"
    ]
    return claim


def a_past_version(world: World) -> dict[str, Any]:
    return {"scan": _former(world)} | wall(world)


def an_own_session(world: World) -> dict[str, Any]:
    """The owner's."""
    begun = world.server.ask("POST", f"{world.path}/sessions", world.owner)
    return {"visit": begun.json()["id"]}


def a_member_for_all(world: World) -> dict[str, Any]:
    """Somebody of the gym whom nobody of the table is."""
    person = world.server.person().id
    assert person is not None
    with world.server.database.writing() as session:
        add_member(session, world.gym.id, person, Role.MEMBER, person)
    return {"person": person}


def a_follower(world: World) -> dict[str, Any]:
    """A person who sent the owner a request."""
    values = a_member_for_all(world)
    with world.server.database.writing() as session:
        row = Follow(follower_id=values["person"], followed_id=world.owner.id, accepted=False)
        session.add(row)
    return values


def a_short_link(world: World) -> dict[str, Any]:
    """Return the short link of a public gym's route."""
    values = a_route(make_world(world.server, visibility="public"))
    return {"code": code_of(UUID(values["route"]))}


HALL = {"parts": ["routes", "dates"], "seconds": 10, "days": 7, "board": True}


def a_push_body() -> dict[str, Any]:
    """Return a push subscription as a browser gives it; nobody listens there."""
    key = generate_private_key(SECP256R1()).public_key()
    point = key.public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
    parts = {"public_key": point, "secret": bytes(16)}
    coded = {name: urlsafe_b64encode(part).decode() for name, part in parts.items()}
    return {"endpoint": f"https://127.0.0.1:9/{uuid4()}"} | coded


def person_id(who: Somebody) -> UUID:
    assert who.id is not None
    return who.id


def an_own_push(world: World) -> dict[str, Any]:
    body = a_push_body()
    row = PushAddress(person_id=person_id(world.owner), **body)
    with world.server.database.writing() as session:
        session.add(row)
    return {"browser": row.id}


def _hall_secret(world: World) -> str:
    link: str = world.server.ask("POST", f"{world.path}/hall/key", world.owner).json()["link"]
    return link.partition("#")[2]


def a_webhook(world: World) -> dict[str, Any]:
    url = {"url": "https://example.com/hook"}
    made = world.server.ask("POST", f"{world.path}/webhooks", world.owner, url)
    return {"webhook": made.json()["id"]}


def a_washing(world: World) -> dict[str, Any]:
    with world.server.database.writing() as session:
        row = Washing(wall_id=world.wall.id)
        session.add(row)
    return {"washing": row.id} | wall(world)


PLAN = {"revision": 0, "routes": [{"number": 1}], "at": "2199-01-01T06:00:00Z"}


def a_plan(world: World) -> dict[str, Any]:
    values = a_draft(world)
    path = f"{world.path}/scans/{values['scan']}/plan"
    assert world.server.ask("PUT", path, world.people["setter"], PLAN).is_success
    return values


def a_passkey(world: World) -> dict[str, Any]:
    device = Device(ORIGIN)
    options = world.server.ask("POST", "/me/passkeys/options", world.owner).json()
    body = {"name": "phone", "credential": device.make(options)}
    made = world.server.ask("POST", "/me/passkeys", world.owner, body)
    return {"passkey": made.json()["id"]}


def a_signed_challenge(world: World) -> object:
    somebody, device = world.server.person(), Device(ORIGIN)
    options = world.server.ask("POST", "/me/passkeys/options", somebody).json()
    body = {"name": "phone", "credential": device.make(options)}
    assert world.server.ask("POST", "/me/passkeys", somebody, body).is_success
    options = world.server.ask("POST", "/session/passkey/options").json()
    return {"credential": device.sign(options)}


def _picture() -> bytes:
    stream = BytesIO()
    Image.new("RGB", (8, 4)).save(stream, "PNG")
    return stream.getvalue()


PICTURE = _picture()


def a_floor_plan(world: World) -> dict[str, Any]:
    path = f"{world.path}/floor-plan/picture"
    assert world.server.ask("PUT", path, world.owner, content=PICTURE).is_success
    return {}


TUS = {"tus-resumable": "1.0.0"}
CLIP = TUS | {"upload-length": "5", "upload-metadata": "filename YS5tcDQ="}
GRADES = {"name": "Ours", "kind": "own", "grades": [{"label": "easy"}, {"label": "hard"}]}

CASES = {
    "request_account": Case("anyone", None, body=lambda w: {"email": f"{w.gym.slug}@example.com"}),
    "make_account": Case(
        "anyone",
        None,
        body=lambda w: {"token": _mailed("sign-up")(w), "name": "New", "password": PASSWORD},
    ),
    "begin_session": Case(
        "anyone",
        None,
        body=lambda w: {"email": w.server.person().email, "password": PASSWORD},
    ),
    "read_second_factor": Case("signed-in"),
    "begin_second_factor": Case("signed-in"),
    "confirm_second_factor": Case("signed-in", body=lambda w: {"code": "123456"}),
    "end_second_factor": Case("signed-in", body=lambda w: {"password": PASSWORD}),
    "end_session": Case("signed-in"),
    "read_me": Case("signed-in"),
    "rename_me": Case("signed-in", body=lambda w: {"name": "Other"}),
    "list_sessions": Case("signed-in"),
    "end_sessions": Case("signed-in"),
    "end_other_session": Case("signed-in", values=an_own_sign_in),
    "make_device_sign_in": Case("signed-in"),
    "read_device_sign_in": Case("signed-in", values=a_device_sign_in),
    "allow_device_sign_in": Case(
        "signed-in", values=a_device_sign_in, body=lambda w: {"code": "123456"}
    ),
    "claim_device_sign_in": Case("anyone", None, body=lambda w: {"secret": _offered(w)}),
    "begin_session_by_device_sign_in": Case("anyone", None, body=lambda w: {"secret": _claimed(w)}),
    "change_password": Case(
        "signed-in", body=lambda w: {"old": PASSWORD, "new": "another chalk bucket 8"}
    ),
    "ask_for_reset": Case("anyone", None, body=lambda w: {"email": f"{w.gym.slug}@example.com"}),
    "reset_password": Case(
        "anyone",
        None,
        body=lambda w: {"token": _mailed("reset")(w), "password": "another chalk bucket 9"},
    ),
    "list_ways_in": Case("anyone", None, body=lambda w: {"token": _mailed("reset")(w)}),
    "list_tokens": Case("signed-in"),
    "make_token": Case("signed-in", body=lambda w: {"name": "t", "scopes": ["read"]}),
    "drop_token": Case("signed-in", values=_token),
    "list_apps": Case("signed-in"),
    "make_app": Case("signed-in", body=_app_body),
    "put_app": Case("signed-in", values=_an_app, body=_plain_app_body),
    "renew_app_secret": Case("signed-in", values=_an_app),
    "delete_app": Case("signed-in", values=_an_app),
    "check_authorization": Case("signed-in", body=_authorization_body),
    "authorize_app": Case("signed-in", body=_authorization_body),
    "list_connected_apps": Case("signed-in"),
    "drop_connected_app": Case("signed-in", values=_a_connection),
    "list_gyms": Case("anyone", Scope.READ),
    "list_own_gyms": Case("signed-in"),
    "make_gym": Case("signed-in", body=lambda w: {"name": f"Hall {_invitation(w)[:9]}"}),
    "accept_invitation": Case("signed-in", body=lambda w: {"secret": _invitation(w)}),
    "read_gym": Case("guest", Scope.READ),
    "change_gym": Case("owner", Scope.MANAGE, body=lambda w: {"place": "Brno"}),
    "close_gym": Case("owner"),
    "read_own_network": Case("owner", Scope.MANAGE),
    "change_own_network": Case("owner", Scope.MANAGE, body=lambda w: {"wanted": False}),
    "join_gym": Case("guest", known=True),
    "leave_gym": Case("member"),
    "list_members": Case("owner", Scope.MANAGE),
    "change_member": Case("owner", Scope.MANAGE, member, lambda w: {"role": "judge"}),
    "drop_member": Case("owner", Scope.MANAGE, member),
    "list_bans": Case("owner", Scope.MANAGE),
    "ban_person": Case("owner", Scope.MANAGE, member, lambda w: {"reason": "again and again"}),
    "drop_ban": Case("owner", Scope.MANAGE, a_banned_person),
    "list_invitations": Case("owner", Scope.MANAGE),
    "make_invitation": Case("owner", Scope.MANAGE, body=lambda w: {"role": "setter"}),
    "drop_invitation": Case("owner", Scope.MANAGE, _row_of(Invitation)),
    "list_grade_systems": Case("guest", Scope.READ),
    "make_grade_system": Case("owner", Scope.MANAGE, body=lambda w: GRADES),
    "change_grade_system": Case("owner", Scope.MANAGE, _row_of(GradeSystem), lambda w: GRADES),
    "drop_grade_system": Case("owner", Scope.MANAGE, _row_of(GradeSystem)),
    "list_changes": Case("owner", Scope.MANAGE),
    "list_walls": Case("guest", Scope.READ),
    "make_wall": Case("setter", Scope.MANAGE, body=lambda w: {"name": "Slab"}),
    "read_floor_plan": Case("guest", Scope.READ),
    "put_floor_plan": Case(
        "owner",
        Scope.MANAGE,
        body=lambda w: {"walls": [{"wall_id": str(w.wall.id), "x": 0.5, "y": 1}]},
    ),
    "put_plan_picture": Case("owner", Scope.MANAGE, content=PICTURE),
    "read_plan_picture": Case("guest", Scope.READ, a_floor_plan),
    "drop_plan_picture": Case("owner", Scope.MANAGE),
    "read_wall": Case("guest", Scope.READ, wall),
    "change_wall": Case("setter", Scope.MANAGE, wall, lambda w: {"place": 3}),
    "drop_wall": Case("owner", Scope.MANAGE, wall),
    "list_lines": Case("guest", Scope.READ, wall),
    "put_line": Case("setter", Scope.MANAGE, a_new_line, a_lines_body),
    "drop_line": Case("setter", Scope.MANAGE, a_line),
    "list_scans": Case("setter", Scope.UPLOAD, wall),
    "begin_scan": Case("setter", Scope.UPLOAD, wall),
    "amend_wall": Case("setter", Scope.PUBLISH, a_published_wall),
    "read_scan": Case("setter", Scope.UPLOAD, a_scan),
    "read_scan_look": Case("setter", Scope.UPLOAD, a_scan),
    "watch_scan": Case("setter", Scope.UPLOAD, a_scan),
    "start_scan": Case("setter", Scope.UPLOAD, a_scan),
    "cancel_scan": Case("setter", Scope.UPLOAD, a_queued_scan),
    "list_photos": Case("setter", Scope.UPLOAD, a_scan),
    "read_overlap": Case("setter", Scope.UPLOAD, a_scan),
    "announce_photo": Case(
        "setter",
        Scope.UPLOAD,
        a_scan,
        headers=TUS | {"upload-length": "5", "upload-metadata": "filename YS5qcGc="},
    ),
    "ask_offset": Case("setter", Scope.UPLOAD, a_photo, headers=TUS),
    "send_photo": Case(
        "setter",
        Scope.UPLOAD,
        a_photo,
        headers=TUS | {"upload-offset": "0", "content-type": "application/offset+octet-stream"},
        content=b"bytes",
    ),
    "drop_photo": Case("setter", Scope.UPLOAD, a_photo, headers=TUS),
    "read_draft": Case("setter", Scope.PUBLISH, a_draft),
    "read_grade_ranges": Case("setter", Scope.PUBLISH, a_draft),
    "read_scan_reach": Case("setter", Scope.PUBLISH, a_draft),
    "publish_scan": Case(
        "setter", Scope.PUBLISH, a_draft, lambda w: {"revision": 0, "routes": [{"number": 1}]}
    ),
    "discard_scan": Case("setter", Scope.PUBLISH, a_draft),
    "scale_scan": Case(
        "setter",
        Scope.PUBLISH,
        _a_model,
        lambda w: {"points": [[0, 0, 0], [0.5, 0, 0]], "metres": 1.0},
    ),
    "put_back_scan": Case(
        "setter", Scope.PUBLISH, wall, lambda w: {"scan_id": str(_former(w)), "revision": 2}
    ),
    "read_edit_log": Case("setter", Scope.PUBLISH, a_draft),
    "save_edit_log": Case(
        "setter",
        Scope.PUBLISH,
        a_draft,
        lambda w: {"version": "0", "edits": {"version": 2, "edits": []}},
    ),
    "try_edit_log": Case(
        "setter", Scope.PUBLISH, a_draft, lambda w: {"edits": {"version": 2, "edits": []}}
    ),
    "propose_problems": Case(
        "setter",
        Scope.PUBLISH,
        a_draft,
        lambda w: {"edits": {"version": 2, "edits": []}, "spec": {"grade": "6C"}},
    ),
    "ease_route": Case(
        "setter",
        Scope.PUBLISH,
        a_draft,
        lambda w: {"edits": {"version": 2, "edits": []}, "route": 1, "way": "easier"},
    ),
    "read_edit_state": Case("setter", Scope.PUBLISH, a_draft),
    "read_edit_photos": Case("setter", Scope.PUBLISH, a_draft),
    "read_published": Case("guest", Scope.READ, a_published_wall),
    "list_past": Case("guest", Scope.READ, a_published_wall),
    "read_past": Case("guest", Scope.READ, a_past_version),
    "read_file": Case("guest", Scope.READ, a_published_file),
    "read_route": Case("guest", Scope.READ, a_route),
    "list_similar_routes": Case("guest", Scope.READ, a_route),
    "describe_route": Case("guest", Scope.READ, a_route_with_moves),
    "change_route": Case("setter", Scope.PUBLISH, a_route, lambda w: {"name": "Moon"}),
    "strip_route": Case("setter", Scope.PUBLISH, a_route),
    "restore_route": Case("setter", Scope.PUBLISH, a_stripped_route),
    "drop_route": Case("setter", Scope.PUBLISH, a_hand_route),
    "list_wall_routes": Case("guest", Scope.READ, wall),
    "make_routes": Case(
        "setter", Scope.PUBLISH, wall, lambda w: {"routes": [{"name": "Moon", "colour": "red"}]}
    ),
    "import_routes": Case(
        "setter",
        Scope.PUBLISH,
        wall,
        lambda w: {"id": str(uuid4()), "csv": "name\nMoon", "really": True},
    ),
    "read_wall_picture": Case("guest", Scope.READ, a_drawn_wall),
    "read_route_picture": Case("guest", Scope.READ, a_drawn_route),
    "put_ascents": Case(
        "member",
        values=an_ascent,
        body=lambda w: {"ascents": [{"id": str(uuid4())} | ascent_body(w)]},
    ),
    "put_ascent": Case(
        "member",
        values=an_ascent,
        body=ascent_body,
    ),
    "list_ascents": Case("signed-in"),
    "change_ascent": Case("signed-in", values=an_own_ascent, body=lambda w: {"kind": "try"}),
    "drop_ascent": Case("signed-in", values=an_own_ascent),
    "read_log_overview": Case("signed-in"),
    "read_log_month": Case("signed-in", values=lambda w: {"month": "2026-03"}),
    "read_log_year": Case("signed-in", values=lambda w: {"year": 2026}),
    "read_log_table": Case("signed-in"),
    "put_other_ascent": Case("signed-in", values=a_new_other_ascent, body=other_ascent_body),
    "drop_other_ascent": Case("signed-in", values=an_other_ascent),
    "import_log": Case(
        "signed-in",
        body=lambda w: {"text": "climbed_at,gym_name,route_name,kind\n2026-01-02,Hall,Moon,top\n"},
    ),
    "read_opinion": Case("member", values=a_route),
    "put_opinion": Case("member", values=a_route, body=lambda w: {"stars": 4}),
    "drop_opinion": Case("member", values=a_route),
    "list_comments": Case("member", Scope.READ, a_route),
    "report_comment": Case("member", values=a_comment, body=lambda w: {"reason": "rude"}),
    "list_reports": Case("setter", Scope.MANAGE),
    "put_hold_report": Case("guest", values=a_new_hold_report, body=_hold_report_body, known=True),
    "list_hold_reports": Case("setter", Scope.READ),
    "close_hold_report": Case("setter", Scope.MANAGE, a_hold_report),
    "reopen_hold_report": Case("setter", Scope.MANAGE, a_hold_report),
    "drop_hold_report": Case("setter", Scope.MANAGE, a_hold_report),
    "list_hold_changes": Case("setter", Scope.READ),
    "close_hold_change": Case("setter", Scope.MANAGE, a_hold_change),
    "reopen_hold_change": Case("setter", Scope.MANAGE, a_hold_change),
    "put_problem": Case("member", values=a_new_problem, body=_problem_body),
    "list_problems": Case("member", Scope.READ, a_published_wall),
    "read_problem": Case("guest", Scope.READ, a_problem),
    "drop_problem": Case("signed-in", values=an_own_problem),
    "put_problem_climbed": Case(
        "member", values=a_members_problem, body=lambda w: {"climbed_at": now().isoformat()}
    ),
    "put_list": Case("member", values=a_new_list, body=_list_body),
    "announce_clip": Case("member", values=a_route_to_film, headers=CLIP),
    "ask_clip_offset": Case("member", values=an_own_clip, headers=TUS),
    "send_clip": Case(
        "member",
        values=an_own_clip,
        headers=TUS | {"upload-offset": "0", "content-type": "application/offset+octet-stream"},
        content=b"bytes",
    ),
    "list_clips": Case("member", Scope.READ),
    "confirm_own_clip": Case(
        "member", values=an_own_clip, body=lambda w: {"moves": [{"number": 0, "hold": 1}]}
    ),
    "read_clip_moves": Case("member", Scope.READ, an_own_clip),
    "drop_clip": Case("member", values=an_own_clip),
    "read_route_beta": Case("guest", Scope.READ, a_route_to_film),
    "list_films": Case("guest", Scope.READ, a_route_to_film),
    "read_film": Case("guest", Scope.READ, a_film),
    "put_film": Case("member", values=a_film, body=lambda w: {"of_age": True}),
    "drop_film": Case("member", values=a_film),
    "report_film": Case("member", values=a_film, body=lambda w: {}),
    "list_film_reports": Case("setter", Scope.MANAGE),
    "dismiss_film_report": Case("setter", Scope.MANAGE, a_film_report),
    "list_lists": Case("member", Scope.READ),
    "read_list": Case("guest", Scope.READ, a_linked_list),
    "read_list_progress": Case("member", Scope.READ, an_own_list),
    "drop_list": Case("signed-in", values=an_own_list),
    "put_list_joined": Case("member", values=a_members_list, body=lambda w: {}),
    "drop_list_joined": Case("member", values=a_members_list),
    "hide_list": Case("setter", Scope.MANAGE, a_members_list),
    "show_list": Case("setter", Scope.MANAGE, a_members_list),
    "estimate_problem": Case(
        "member",
        values=a_wall_for_problems,
        body=lambda w: {
            name: value for name, value in _problem_body(w).items() if name in ("scan_id", "holds")
        },
    ),
    "find_problem_moves": Case(
        "member",
        values=a_wall_for_problems,
        body=lambda w: {
            name: value for name, value in _problem_body(w).items() if name in ("scan_id", "holds")
        },
    ),
    "find_problem_openings": Case(
        "member",
        values=a_wall_for_problems,
        body=lambda w: {
            name: value for name, value in _problem_body(w).items() if name in ("scan_id", "holds")
        },
    ),
    "promote_problem": Case("setter", Scope.PUBLISH, a_members_problem),
    "report_problem": Case("member", values=a_members_problem, body=lambda w: {"reason": "rude"}),
    "list_problem_reports": Case("setter", Scope.MANAGE),
    "dismiss_problem_report": Case("setter", Scope.MANAGE, a_problem_report),
    "hide_problem": Case("setter", Scope.MANAGE, a_members_problem),
    "show_problem": Case("setter", Scope.MANAGE, a_members_problem),
    "list_reset_plans": Case("member", Scope.READ),
    "find_reset_people": Case("setter", Scope.READ),
    "put_reset_plan": Case("setter", Scope.MANAGE, a_new_reset_plan, _reset_plan_body),
    "read_reset_plan": Case("setter", Scope.READ, a_reset_plan),
    "put_reset_state": Case("setter", Scope.MANAGE, a_reset_plan, lambda w: {"state": "set"}),
    "drop_reset_plan": Case("setter", Scope.MANAGE, a_reset_plan),
    "read_forerun": Case("member", Scope.READ, a_reset_plan),
    "put_proposal": Case("member", values=a_route_to_forerun, body=lambda w: {"risk": 2}),
    "drop_proposal": Case("member", values=a_route_to_forerun),
    "put_sign_off": Case("setter", Scope.PUBLISH, a_route_to_forerun, a_grade),
    "dismiss_report": Case("setter", Scope.MANAGE, a_report),
    "hide_comment": Case("setter", Scope.MANAGE, a_comment),
    "show_comment": Case("setter", Scope.MANAGE, a_comment),
    "list_tallies": Case("guest", Scope.READ, a_published_wall),
    "list_gym_tallies": Case("guest", Scope.READ),
    "read_route_history": Case("guest", Scope.READ, a_route),
    "list_routes": Case("guest", Scope.READ),
    "read_logbook": Case("member", Scope.READ),
    "read_profile": Case("signed-in"),
    "put_profile": Case("signed-in", body=lambda w: {"on_boards": True, "show_pins": "gym"}),
    "read_person": Case("signed-in", values=member),
    "pin_ascent": Case("signed-in", values=an_own_ascent),
    "unpin_ascent": Case("signed-in", values=an_own_ascent),
    "list_climbing_sessions": Case("member", Scope.READ),
    "start_climbing_session": Case("member"),
    "read_climbing_session": Case("member", Scope.READ, an_own_session),
    "end_climbing_session": Case("member", values=an_own_session),
    "read_progress": Case("member", Scope.READ),
    "read_progress_table": Case("member", Scope.READ, lambda w: {"part": "weeks"}),
    "read_board": Case("member", Scope.READ),
    "read_insights": Case("setter", Scope.READ),
    "read_style_insights": Case("setter", Scope.READ),
    "read_hold_insights": Case("setter", Scope.READ),
    "read_insights_table": Case("setter", Scope.READ, lambda w: {"part": "wear"}),
    "list_resets": Case("setter", Scope.READ, wall),
    "list_lacking_grades": Case("setter", Scope.READ, wall),
    "put_targets": Case(
        "setter", Scope.MANAGE, body=lambda w: {"cells": [{"steepness": "slab", "routes": 3}]}
    ),
    "put_stock": Case(
        "setter",
        Scope.MANAGE,
        body=lambda w: {"rows": [{"colour": "red", "total": 40}], "wash_after": 100},
    ),
    "wash_wall": Case("setter", Scope.MANAGE, wall),
    "drop_washing": Case("setter", Scope.MANAGE, a_washing),
    "list_follows": Case("signed-in"),
    "follow_person": Case("signed-in", values=a_member_for_all),
    "unfollow_person": Case("signed-in", values=a_member_for_all),
    "accept_follower": Case("signed-in", values=a_follower),
    "drop_follower": Case("signed-in", values=a_member_for_all),
    "set_feed": Case("signed-in", body=lambda w: {"on": False}),
    "read_feed": Case("member", Scope.READ),
    "list_friends_here": Case("member", Scope.READ, a_route),
    "begin_passkey": Case("signed-in"),
    "confirm_by_password": Case("signed-in", body=lambda w: {"password": PASSWORD}),
    "confirm_by_passkey": Case("signed-in", body=a_signed_challenge),
    "make_passkey": Case("signed-in", body=lambda w: {"name": "phone", "credential": {}}),
    "list_passkeys": Case("signed-in"),
    "drop_passkey": Case("signed-in", values=a_passkey),
    "begin_passkey_session": Case("anyone", None),
    "begin_session_by_passkey": Case("anyone", None, body=a_signed_challenge),
    "read_server": Case("anyone", Scope.READ),
    "list_findings": Case("operator"),
    "list_operator_workers": Case("operator"),
    "read_mail_queue": Case("operator"),
    "send_waiting_mails": Case("operator"),
    "list_operator_jobs": Case("operator"),
    "retry_operator_job": Case("operator", body=lambda w: {"id": "none"}),
    "retry_operator_scan": Case("operator", values=a_scan),
    "cancel_operator_scan": Case("operator", values=a_queued_scan),
    "read_storage": Case("operator"),
    "measure_operator_storage": Case("operator"),
    "list_setup_backups": Case("anyone", None, body=lambda w: {"code": "wrong"}),
    "upload_backup": Case("anyone", None, content=b"a backup"),
    "restore_into_empty": Case("anyone", None, body=lambda w: {"code": "wrong", "name": None}),
    "list_backups": Case("operator"),
    "make_backup": Case("operator"),
    "try_stored_backup": Case("operator", values=lambda w: {"name": "none.tar"}),
    "restore_backup": Case(
        "operator",
        values=lambda w: {"name": "none.tar"},
        body=lambda w: {"server": "walls.example.com"},
    ),
    "download_backup": Case("operator", values=lambda w: {"name": "none.tar"}),
    "list_announcements": Case("anyone", Scope.READ),
    "list_operator_announcements": Case("operator"),
    "announce": Case("operator", body=lambda w: {"texts": {"en": "Closed on Monday"}}),
    "withdraw_announcement": Case("operator", values=an_announcement),
    "list_operator_gyms": Case("operator"),
    "limit_operator_gym": Case(
        "operator",
        values=lambda w: {"gym_id": w.gym.id},
        body=lambda w: {"quota_mb": 500, "features_barred": ["clips"]},
    ),
    "read_gym_storage": Case("owner", Scope.MANAGE),
    "list_users": Case("operator", query=lambda w: "?search=owner"),
    "lock_account": Case("operator", values=member),
    "unlock_account": Case("operator", values=member),
    "sign_out_account": Case("operator", values=member),
    "reset_account_factor": Case("operator", values=member),
    "export_account": Case("operator", values=member),
    "delete_user_account": Case("operator", values=member, body=a_members_address),
    "read_data": Case("signed-in"),
    "read_ascents_table": Case("signed-in"),
    "delete_me": Case("signed-in", body=lambda w: {"password": PASSWORD}),
    "read_screen": Case("guest", Scope.READ),
    "read_hall": Case("setter", Scope.MANAGE),
    "put_hall": Case("owner", Scope.MANAGE, body=lambda w: HALL),
    "make_hall_key": Case("owner", Scope.MANAGE),
    "drop_hall_key": Case("owner", Scope.MANAGE),
    "open_screen": Case("anyone", None, body=lambda w: {"secret": _hall_secret(w)}),
    "read_poster": Case("setter", Scope.MANAGE),
    "read_cards": Case("setter", Scope.MANAGE, lambda w: a_route(w) and {}),
    "read_calendar": Case("guest", Scope.READ),
    "read_new_routes": Case("guest", Scope.READ),
    "read_preferences": Case("signed-in"),
    "put_preferences": Case("signed-in", body=lambda w: {"digest": True, "language": "de"}),
    "put_push": Case("signed-in", body=lambda w: a_push_body()),
    "drop_push": Case("signed-in", values=an_own_push),
    "try_push": Case("signed-in", values=an_own_push),
    "end_mails": Case("anyone", None, a_mails_link),
    "read_preferences_by_link": Case("anyone", Scope.READ, a_mails_link),
    "put_preferences_by_link": Case("anyone", None, a_mails_link, lambda w: {"digest": True}),
    "read_short_link": Case("anyone", Scope.READ, a_short_link),
    "read_scale_plate": Case("anyone", Scope.READ, lambda w: {"paper": "a4", "number": 1}),
    "read_stickers": Case("anyone", Scope.READ, lambda w: {"paper": "a4", "count": 6}),
    "list_webhooks": Case("owner", Scope.MANAGE),
    "make_webhook": Case("owner", Scope.MANAGE, body=lambda w: {"url": "https://example.com/"}),
    "replay_delivery": Case("owner", Scope.MANAGE, _a_delivery),
    "drop_webhook": Case("owner", Scope.MANAGE, a_webhook),
    "list_plans": Case("setter", Scope.PUBLISH),
    "put_plan": Case("setter", Scope.PUBLISH, a_draft, lambda w: PLAN),
    "drop_plan": Case("setter", Scope.PUBLISH, a_plan),
    "read_thumbnail": Case("setter", Scope.UPLOAD, a_seen_photo),
    "list_competitions": Case("guest", Scope.READ),
    "make_competition": Case("setter", Scope.MANAGE, body=lambda w: cups.CUP),
    "read_competition": Case("guest", Scope.READ, cups.a_competition),
    "change_competition": Case(
        "setter", Scope.MANAGE, cups.a_competition, lambda w: {"fee": "12 €"}
    ),
    "put_competition_sheet": Case("setter", Scope.MANAGE, cups.a_competition, cups.a_sheet),
    "put_competition_state": Case(
        "setter", Scope.MANAGE, cups.a_competition, lambda w: {"state": "ended"}
    ),
    "freeze_board": Case("setter", Scope.MANAGE, cups.a_competition, lambda w: {"frozen": True}),
    "drop_competition": Case("owner", Scope.MANAGE, cups.a_competition),
    "put_round_state": Case(
        "setter", Scope.MANAGE, cups.with_row(Round, "one"), lambda w: {"state": "ended"}
    ),
    "list_starters": Case("guest", Scope.READ, cups.with_row(Round, "one")),
    "put_starters": Case("setter", Scope.MANAGE, cups.with_row(Round, "one", 1), cups.an_order),
    "draw_starters": Case("setter", Scope.MANAGE, cups.with_row(Round, "one")),
    "list_entries": Case("judge", Scope.MANAGE, cups.a_competition),
    "make_entry": Case("setter", Scope.MANAGE, cups.a_competition, cups.a_competitor),
    "change_competitor": Case(
        "setter", Scope.MANAGE, cups.with_row(Entry, "entry"), lambda w: {"team": "Blue"}
    ),
    "import_entries": Case(
        "setter", Scope.MANAGE, cups.a_competition, lambda w: {"csv": "name\nIvo\n"}
    ),
    "sign_waiver": Case(
        "judge", Scope.MANAGE, cups.with_row(Entry, "entry"), lambda w: {"signed_by": "Eva"}
    ),
    "read_own_entry": Case("member", Scope.READ, cups.a_competition),
    "enter_competition": Case("member", None, cups.a_competition, cups.oneself),
    "withdraw": Case("member", None, cups.a_competition),
    "put_score_event": Case("member", None, cups.an_event, cups.a_top),
    "list_score_events": Case("judge", Scope.MANAGE, cups.a_competition),
    "list_marks": Case("judge", Scope.MANAGE, cups.a_problem),
    "list_judge_links": Case("setter", Scope.MANAGE, cups.a_judge_link),
    "make_judge_link": Case("setter", Scope.MANAGE, cups.a_problem),
    "make_judge_sheet": Case("setter", Scope.MANAGE, cups.with_row(Round, "one")),
    "revoke_judge_link": Case("setter", Scope.MANAGE, cups.a_judge_link),
    "revoke_judge_links": Case("setter", Scope.MANAGE, cups.with_row(Round, "one")),
    "open_judge_link": Case(
        "anyone",
        None,
        cups.a_judge_link,
        lambda w: {"secret": cups.secret_of(w), "name": "E"},
    ),
    "read_judge_pad": Case("judge-link", None, cups.a_judge_link, cookie=cups.cookie_of),
    "put_link_event": Case(
        "judge-link", None, cups.an_event_by_link, cups.a_top, cookie=cups.cookie_of
    ),
    "list_appeals": Case("judge", Scope.MANAGE, cups.a_competition),
    "read_competition_board": Case("guest", Scope.READ, cups.a_competition),
    "explain_order": Case("guest", Scope.READ, cups.a_competition, query=cups.two_of_them),
    "watch_competition_board": Case("guest", Scope.READ, cups.an_ended_competition),
    "read_results_table": Case("guest", Scope.READ, cups.a_competition),
    "read_results_paper": Case("guest", Scope.READ, cups.a_competition),
    "read_inspection_plan": Case("setter", Scope.READ),
    "put_inspection_plan": Case("owner", Scope.MANAGE, body=_plan_of_inspections),
    "list_due_inspections": Case("setter", Scope.READ),
    "make_inspection": Case(
        "setter", Scope.MANAGE, body=lambda w: {"level": "visual", "walls": [str(w.wall.id)]}
    ),
    "list_inspections": Case("setter", Scope.READ),
    "read_inspection": Case("setter", Scope.READ, an_inspection),
    "end_inspection": Case(
        "setter", Scope.MANAGE, an_inspection, body=lambda w: {"result": "passed"}
    ),
    "drop_inspection": Case("setter", Scope.MANAGE, an_inspection),
    "put_inspection_entry": Case(
        "setter",
        Scope.MANAGE,
        an_inspection_entry,
        body=lambda w: {"wall_id": str(w.wall.id), "hold": 1, "mark": "washed"},
    ),
    "send_inspection_photo": Case("setter", Scope.MANAGE, an_inspection, content=photo()),
    "read_inspection_photo": Case("setter", Scope.READ, an_inspection_photo),
    "read_inspection_paper": Case("setter", Scope.READ, an_ended_inspection),
    "read_inspection_file": Case("setter", Scope.READ, an_ended_inspection),
    "read_inspection_table": Case("setter", Scope.READ, an_ended_inspection),
    "verify_inspection": Case("anyone", Scope.READ, an_inspection_code),
    "read_hold_history": Case("setter", Scope.READ, a_hold),
}


def operations(server: Server) -> dict[str, tuple[str, str, dict[str, Any]]]:
    """Operation to method, path and its part of the document."""
    paths = server.app.openapi()["paths"]
    return {
        operation["operationId"]: (method.upper(), path.removeprefix("/api/v1"), operation)
        for path, methods in paths.items()
        for method, operation in methods.items()
    }


# Requests that pass the rule and fail for another reason: a gym keeps an owner; a token is its
# maker's, an ascent its climber's.
EXCEPT = (
    {(name, "owner"): 409 for name in ("leave_gym", "delete_me")}
    | {("confirm_second_factor", kind): 409 for kind in PEOPLE}  # none was begun
    | {("drop_film", kind): 403 for kind in ("member", "judge")}  # another's
    | {
        (name, kind): 404
        for name in (
            "drop_push",
            "try_push",
            "drop_token",
            "put_app",
            "renew_app_secret",
            "delete_app",
            "drop_connected_app",
            "change_ascent",
            "drop_ascent",
            "drop_other_ascent",
            "drop_problem",
            "drop_list",
            "ask_clip_offset",
            "send_clip",
            "confirm_own_clip",
            "read_clip_moves",
            "drop_clip",
            "put_film",
            "read_list_progress",
            "drop_passkey",
            "pin_ascent",
            "unpin_ascent",
        )
        for kind in PEOPLE
        if kind != "owner"
    }
    | {
        (name, kind): 404
        for name in (
            "end_other_session",
            "read_device_sign_in",
            "allow_device_sign_in",
            "accept_follower",
            "read_climbing_session",
            "end_climbing_session",
        )
        for kind in PEOPLE
        if kind != "owner"
    }
    # Nobody has taken the offer up: test_gym_device_sign_in.py does.
    | {("allow_device_sign_in", "owner"): 422}
    # People without a common gym do not see each other.
    | {
        (name, kind): 404
        for name in ("read_person", "follow_person")
        for kind in ("stranger", "operator")
    }
    # Nothing is sent into our own network: test_gym_messages.py in hall has a service.
    | {("put_push", kind): 422 for kind in PEOPLE}
    | {("try_push", "owner"): 422}
    # No answer of a device: test_gym_passkeys.py has real ones.
    | {("make_passkey", kind): 422 for kind in PEOPLE}
    # It is somebody else's passkey: test_gym_ways_in.py has one's own.
    | {("confirm_by_passkey", kind): 422 for kind in PEOPLE}
    # No job was set aside: test_gym_operator_page.py has one.
    | {("retry_operator_job", "operator"): 404}
    # The server is not empty: test_gym_setup.py has one that is.
    | {
        (name, kind): 422
        for name in ("list_setup_backups", "upload_backup", "restore_into_empty")
        for kind in PEOPLE
    }
    # No target of backups is set: test_gym_operator_backups.py has one.
    | {
        (f"{verb}_backup", "operator"): 409
        for verb in ("make", "try_stored", "restore", "download")
    }
    # There is no wall in the scans of this table.
    | {
        (name, kind): 422
        for name in (
            "save_edit_log",
            "try_edit_log",
            "propose_problems",
            "ease_route",
            "read_edit_photos",
        )
        for kind in PEOPLE
    }
)

Request = tuple[str, str, object, dict[str, str], bytes | None]


def prepare(world: World, name: str, **other: Any) -> Request:
    """A use of an endpoint as the table says; `other` values stand for its own in the path."""
    method, path, _ = operations(world.server)[name]
    case = CASES[name]
    values = {"gym": world.gym.slug, **case.values(world), **other}
    path = path.format(**values) + case.query(world)
    cookie = case.cookie(world)
    headers = case.headers | ({"cookie": cookie} if cookie else {})
    return method, path, case.body(world), headers, case.content


def send(world: World, request: Request, who: Somebody) -> httpx.Response:
    method, path, body, headers, content = request
    return world.server.ask(method, path, who, body, headers, content)


def expected(case: Case, kind: str, visibility: str) -> int | None:
    """The status of a refusal; None where it is allowed."""
    if case.who in ROLES:
        role = kind if kind in ROLES else "guest"
        if visibility == "private" and role == "guest":
            return 404
        if case.known and kind == "nobody":
            return 401
        if ROLES.index(role) < ROLES.index(case.who):
            return 401 if kind == "nobody" else 403
        return None
    if case.who == "operator" and kind not in ("nobody", "operator"):
        return 403
    is_open = case.who in ("anyone", "judge-link")
    return 401 if kind == "nobody" and not is_open else None


def audit_length(world: World) -> int:
    with world.server.database.reading() as session:
        return session.scalar(select(func.count()).select_from(AuditEntry)) or 0


def test_every_endpoint_is_in_the_table(server: Server) -> None:
    found = operations(server)
    assert set(found) == set(CASES)
    rules = {name: operation["x-walltopo-rule"] for name, (_, _, operation) in found.items()}
    assert rules == {
        name: {"who": case.who} | ({"scope": case.scope.value} if case.scope else {})
        for name, case in CASES.items()
    }


def visibilities(name: str) -> tuple[str, ...]:
    return ("public", "private") if CASES[name].who in ROLES else ("private",)


@pytest.mark.parametrize("name", CASES)
def test_who_may_not(server: Server, name: str) -> None:
    """They are refused, and nothing changes by it."""
    for visibility in visibilities(name):
        world = make_world(server, visibility=visibility)
        request = prepare(world, name)
        before = audit_length(world)
        for kind in PEOPLE:
            refusal = expected(CASES[name], kind, visibility)
            if refusal is not None:
                answer = send(world, request, world.people[kind])
                assert answer.status_code == refusal, (visibility, kind, answer.text)
        assert audit_length(world) == before


@pytest.mark.parametrize("name", CASES)
def test_who_may(server: Server, name: str) -> None:
    """Each sends the request to a world of their own, unless it reads only."""
    reads = operations(server)[name][0] == "GET"
    for visibility in visibilities(name):
        world, request = None, None
        for kind in PEOPLE:
            if expected(CASES[name], kind, visibility) is None:
                if world is None or request is None or not reads:
                    world = make_world(server, visibility=visibility)
                    request = prepare(world, name)
                answer = send(world, request, world.people[kind])
                wanted = EXCEPT.get((name, kind), 200)
                is_right = answer.is_success if wanted == 200 else answer.status_code == wanted
                assert is_right, (visibility, kind, answer.text)


@pytest.mark.parametrize("name", CASES)
def test_what_a_token_may(server: Server, name: str) -> None:
    scope = CASES[name].scope
    others = [other for other in Scope if other != scope]
    for scopes, is_enough in ((others, False), ([scope] if scope else [], scope is not None)):
        if scopes:
            world = make_world(server)
            answer = send(world, prepare(world, name), server.token(world.owner, *scopes))
            let_in = answer.is_success or answer.status_code == EXCEPT.get((name, "owner"))
            assert let_in == is_enough, answer.text
            assert is_enough or answer.status_code == 403


BELOW_A_GYM = [
    name
    for name, case in CASES.items()
    if case.who in ROLES
    and case.values not in (no_values, a_floor_plan)
    # The first five name a route or wall in their body (test_gym_ascents.py, test_gym_lists.py,
    # test_gym_problems.py, test_gym_hold_reports.py, test_gym_reset_plans.py), the others nothing
    # of a gym.
    and name
    not in (
        "put_ascent",
        "put_ascents",
        "put_hold_report",
        "put_list",
        "put_problem",
        "put_reset_plan",
        "read_progress_table",
        "read_insights_table",
        "read_cards",
    )
]


@pytest.mark.parametrize("name", BELOW_A_GYM)
def test_what_belongs_to_another_gym_is_not_there(server: Server, name: str) -> None:
    """An owner who names their own gym and another's wall, member or grades."""
    theirs = make_world(server, visibility="public")
    ours = make_world(server)
    answer = send(ours, prepare(ours, name, **CASES[name].values(theirs)), ours.owner)
    assert answer.status_code == 404, answer.text
