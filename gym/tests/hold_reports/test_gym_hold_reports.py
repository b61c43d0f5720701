"""Hold reports: stored once, listed until done or stripped, followed over versions."""

from __future__ import annotations

from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.worlds import World, hold, make_world
from sqlalchemy import select

from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.models import Ban
from walltopo_gym.gyms.roles import Role
from walltopo_gym.hold_reports.models import HoldReport
from walltopo_gym.operating.own_data import delete_account
from walltopo_gym.webhooks.models import WebhookEvent


@pytest.fixture
def scan(world: World) -> UUID:
    """A published version: hold 1 on the route Moon, hold 2 without a route."""
    made = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0), hold(2, 1.0, 1.0, colour="blue")])
    assert world.publish(made, {"number": 1, "name": "Moon"}).is_success
    return made


def report(world: World, who: str, scan: UUID, *, key: UUID | None = None, **facts: Any) -> Any:
    body = {"wall_id": str(world.wall.id), "scan_id": str(scan), "hold": 1, "kind": "spins"}
    path = f"{world.path}/hold-reports/{key or uuid4()}"
    return world.server.ask("PUT", path, world.people[who], body | facts)


def to_check(world: World, query: str = "") -> Any:
    answer = world.server.ask("GET", f"{world.path}/hold-reports{query}", world.people["setter"])
    assert answer.status_code == 200, answer.text
    return answer.json()


def decide(world: World, method: str, key: str, part: str = "/done") -> None:
    path = f"{world.path}/hold-reports/{key}{part}"
    assert world.server.ask(method, path, world.people["setter"]).status_code == 204


def test_one_open_report_of_a_person_hold_and_kind(world: World, scan: UUID) -> None:
    key = uuid4()
    first = report(world, "member", scan, key=key, note="by half a turn")
    assert first.status_code == 201, first.text
    assert report(world, "member", scan, key=key).status_code == 200
    again = report(world, "member", scan)
    assert (again.status_code, again.json()["id"]) == (200, str(key))
    assert report(world, "member", scan, kind="sharp").status_code == 201
    assert report(world, "judge", scan).status_code == 201
    assert report(world, "judge", scan, key=key).status_code == 409
    [one] = to_check(world)
    assert (one["people"], one["route_name"], one["colour"]) == (2, "Moon", "red")
    assert (one["current_hold"], one["earlier"]) == (1, False)
    assert [row["kind"] for row in one["reports"]] == ["spins", "sharp", "spins"]
    assert one["reports"][0]["note"] == "by half a turn"


def test_done_closes_all_reports_of_the_hold_and_undo_opens_them(world: World, scan: UUID) -> None:
    report(world, "member", scan)
    report(world, "judge", scan, kind="dirty")
    assert report(world, "member", scan, hold=2, note="x" * 300).status_code == 201
    first, other = to_check(world, f"?wall={world.wall.id}")
    key = first["reports"][0]["id"]
    for _ in range(2):
        decide(world, "PUT", key)
    assert to_check(world) == [other]
    [done] = to_check(world, "?done=true")
    assert len(done["reports"]) == 2
    assert done["done_at"] is not None
    assert report(world, "member", scan).status_code == 201  # it spins again
    for _ in range(2):
        decide(world, "DELETE", key)
    assert sorted(len(one["reports"]) for one in to_check(world)) == [1, 3]
    decide(world, "DELETE", key, "")
    assert sorted(len(one["reports"]) for one in to_check(world)) == [1, 2]
    with world.server.database.reading() as session:
        mine = select(AuditEntry.action).where(AuditEntry.gym_id == world.gym.id)
        log = [action for action in session.scalars(mine) if action.startswith("hold.")]
    assert sorted(log) == ["hold.delete", "hold.done", "hold.open"]


def test_a_report_names_a_hold_or_route_of_a_published_version(world: World, scan: UUID) -> None:
    route = world.published()["routes"][0]["id"]
    assert report(world, "member", scan, hold=None, route_id=route).status_code == 201
    assert report(world, "member", scan, hold=None, route_id=route).status_code == 200
    draft = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    wrong = {
        "hold-unknown": report(world, "member", scan, hold=7),
        "hold-or-route": report(world, "member", scan, hold=None),
        "hold-version-unknown": report(world, "member", draft),
    }
    for code, answer in wrong.items():
        assert (answer.status_code, answer.json()["code"]) == (422, code)
    theirs = make_world(world.server, world.people)
    assert report(theirs, "member", scan).status_code == 422  # of another gym
    assert report(world, "member", scan, wall_id=str(theirs.wall.id)).status_code == 404
    assert report(world, "member", scan, note="x" * 301).status_code == 422
    assert report(world, "member", scan, kind="ugly").status_code == 422
    [one] = to_check(world)
    assert (one["hold"], one["route_id"], one["earlier"]) == (None, route, False)


def test_an_amendment_keeps_the_hold_and_a_new_scan_does_not(world: World, scan: UUID) -> None:
    report(world, "member", scan)
    report(world, "member", scan, hold=2)
    route = world.published()["routes"][0]["id"]
    holds = [hold(1, 0.0, 1.0), hold(2, 1.0, 1.0)]
    amendment = world.reviewed({1: [1]}, holds, amends_id=scan)
    assert world.publish(amendment, {"number": 1, "route_id": route}, revision=1).is_success
    assert [one["current_hold"] for one in to_check(world)] == [1, 2]
    assert report(world, "member", amendment).status_code == 200
    assert report(world, "judge", amendment).status_code == 201
    assert [one["people"] for one in to_check(world)] == [2, 1]
    later = world.reviewed({1: [2]}, holds)
    assert world.publish(later, {"number": 1, "route_id": route}, revision=2).is_success
    [one] = to_check(world)  # that of the hold without a route cannot be followed
    assert (one["current_hold"], one["earlier"], one["people"]) == (None, True, 2)


def test_a_stripped_hold_leaves_the_list(world: World, scan: UUID) -> None:
    report(world, "member", scan)
    assert len(to_check(world)) == 1
    path = f"{world.path}/routes/{world.published()['routes'][0]['id']}"
    assert world.server.ask("POST", f"{path}/strip", world.people["setter"]).is_success
    assert to_check(world) == []


def test_who_may_report_and_how_often(world: World, scan: UUID) -> None:
    assert report(world, "stranger", scan).status_code == 404  # a private gym
    judge = world.people["judge"].id
    assert judge is not None
    with world.server.database.writing() as session:
        session.add(Ban(gym_id=world.gym.id, person_id=judge, reason=""))
    assert report(world, "judge", scan).status_code == 403
    path = f"{world.path}/hold-reports"
    report(world, "owner", scan)
    for _ in range(29):
        [one] = to_check(world)
        decide(world, "PUT", one["reports"][0]["id"])
        assert report(world, "owner", scan).status_code == 201
    assert report(world, "owner", scan, kind="dirty").status_code == 429
    assert world.server.ask("GET", path, world.people["member"]).status_code == 403


def test_the_report_of_a_deleted_account_stays_anonymous(world: World, scan: UUID) -> None:
    person = world.server.person()
    world = World(world.server, world.gym, world.wall, world.people | {"leaving": person})
    with world.server.database.writing() as session:
        assert person.id is not None
        add_member(session, world.gym.id, person.id, Role.MEMBER, person.id)
    made = report(world, "leaving", scan)
    assert made.status_code == 201
    data = world.server.ask("GET", "/me/data", person).json()
    assert [row["id"] for row in data["hold_reports"]] == [made.json()["id"]]
    with world.server.database.writing() as session:
        delete_account(session, person.id)
    assert to_check(world)[0]["people"] == 1
    with world.server.database.reading() as session:
        row = session.get_one(HoldReport, UUID(made.json()["id"]))
    assert row.person_id is None


def test_a_webhook_hears_of_each_report_once(world: World, scan: UUID) -> None:
    url = {"url": "https://example.com/hook"}
    hook = world.server.ask("POST", f"{world.path}/webhooks", world.owner, url).json()["id"]
    made = report(world, "member", scan).json()["id"]
    report(world, "member", scan)
    with world.server.database.reading() as session:
        mine = select(WebhookEvent.body).where(WebhookEvent.webhook_id == UUID(hook))
        [body] = session.scalars(mine).all()
    assert body["type"] == "hold.reported"
    assert body["data"] == {"wall": str(world.wall.id), "report": made}
