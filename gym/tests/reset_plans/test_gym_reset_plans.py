"""Planned resets: one open plan a wall, its routes, proposals with their median, and sign-off."""

from __future__ import annotations

import unicodedata
from datetime import timedelta
from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.worlds import Somebody, World, hold, make_world
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.events import RoutesToForerun
from walltopo_gym.gyms.members import add_member, change_role
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.gyms.roles import Role
from walltopo_gym.operating.own_data import delete_account
from walltopo_gym.reset_plans.models import GradeProposal
from walltopo_gym.reset_plans.proposals import median_of
from walltopo_gym.scans.models import Scan


def person_id(who: Somebody) -> UUID:
    assert who.id is not None
    return who.id


@pytest.fixture
def font(world: World) -> str:
    """The id of the gym's Font scale."""
    with world.server.database.reading() as session:
        mine = select(GradeSystem.id).where(
            GradeSystem.gym_id == world.gym.id, GradeSystem.kind == "font"
        )
        found = session.scalars(mine).first()
    if found is not None:
        return str(found)
    grades = [{"label": label} for label in ("5", "6A", "6B", "6C", "7A")]
    body = {"name": "Scale", "kind": "own", "grades": grades}
    made = world.server.ask("POST", f"{world.path}/grade-systems", world.owner, body)
    assert made.status_code == 201, made.text
    return str(made.json()["id"])


def plan(world: World, who: str = "setter", *, key: UUID | None = None, **words: Any) -> Any:
    body = {"wall_id": str(world.wall.id), "day": str(world.gym.today())}
    path = f"{world.path}/reset-plans/{key or uuid4()}"
    return world.server.ask("PUT", path, world.people[who], body | words)


def planned(world: World, **words: Any) -> str:
    made = plan(world, **words)
    assert made.status_code == 201, made.text
    return str(made.json()["id"])


def ask(world: World, method: str, path: str, who: str = "setter", body: object = None) -> Any:
    answer = world.server.ask(method, f"{world.path}{path}", world.people[who], body)
    assert answer.is_success, answer.text
    return answer.json() if answer.content else None


def by_hand(world: World, name: str, **facts: Any) -> str:
    body = {"routes": [{"name": name, **facts}]}
    return str(ask(world, "POST", f"/walls/{world.wall.id}/routes", body=body)[0]["id"])


def test_a_plan_is_stored_once_and_changed(world: World, font: str) -> None:
    key, wishes = uuid4(), [{"system": font, "grade": "6A", "routes": 3}]
    setter = {"id": str(world.people["setter"].id), "name": "setter"}
    words: dict[str, Any] = {
        "note": "Keep the volumes",
        "wishes": wishes,
        "setters": [setter["id"]],
    }
    first = plan(world, key=key, **words)
    assert first.status_code == 201, first.text
    again = plan(world, key=key, **words)
    assert (again.status_code, again.json()) == (200, first.json())
    assert (first.json()["state"], first.json()["setters"]) == ("planned", [setter])
    day = str(world.gym.today() + timedelta(days=2))
    changed = plan(world, key=key, day=day).json()
    assert (changed["day"], changed["wishes"], changed["setters"]) == (day, [], [])
    [one] = ask(world, "GET", "/reset-plans")
    assert (one["id"], one["wall_name"], one["published_at"]) == (str(key), "Cave", None)
    ask(world, "DELETE", f"/reset-plans/{key}")
    assert ask(world, "GET", "/reset-plans") == []


def test_wrong_plans_are_refused(world: World, font: str) -> None:
    member, wish = str(world.people["member"].id), {"system": font, "grade": "6A", "routes": 1}
    wrong = {
        "reset-person": plan(world, setters=[member]),
        "reset-wish-twice": plan(world, wishes=[wish, wish]),
        "grade-unknown": plan(world, wishes=[wish | {"grade": "12"}]),
    }
    for code, answer in wrong.items():
        assert (answer.status_code, answer.json()["code"]) == (422, code)
    stranger = str(world.people["stranger"].id)
    assert plan(world, forerunners=[stranger]).json()["code"] == "reset-person"
    key = planned(world, forerunners=[member])
    assert plan(world).json()["code"] == "reset-open"
    theirs = make_world(world.server, world.people)
    assert plan(theirs, key=UUID(key)).status_code == 409
    assert plan(theirs, wall_id=str(world.wall.id)).status_code == 404


def test_a_setter_who_lost_the_role_stays_on_the_plan(world: World) -> None:
    person = world.server.person("Ida").id
    assert person is not None
    with world.server.database.writing() as session:
        add_member(session, world.gym.id, person, Role.SETTER, person)
    key = planned(world, setters=[str(person)])
    with world.server.database.writing() as session:
        change_role(session, world.gym.id, person, Role.MEMBER, person)
    again = plan(world, key=UUID(key), setters=[str(person)], note='later,\nby "Ida"')
    assert [one["name"] for one in again.json()["setters"]] == ["Ida"]


def test_people_to_name(world: World) -> None:
    def found(query: str) -> set[str]:
        return {one["name"] for one in ask(world, "GET", f"/reset-plans/people{query}")}

    assert found("") == {"setter", "owner"}
    assert found("?named=Memb") == {"member"}
    assert found("?named=m") == set()
    assert found("?named=%25%25") == set()
    assert found("?named=stranger") == set()
    person = world.server.person("Žofie").id
    assert person is not None
    with world.server.database.writing() as session:
        add_member(session, world.gym.id, person, Role.MEMBER, person)
    assert found("?named=žof") == {"Žofie"}
    assert found(f"?named={unicodedata.normalize('NFD', 'žof')}") == {"Žofie"}


def test_routes_of_a_plan_are_those_set_since_its_day(world: World, font: str) -> None:
    earlier = str(world.gym.today() - timedelta(days=1))
    by_hand(world, "Old", set_on=earlier)
    key = planned(world)
    moon, sun = by_hand(world, "Moon"), by_hand(world, "Sun")
    ask(world, "POST", f"/routes/{sun}/strip")
    found = ask(world, "GET", f"/reset-plans/{key}")
    assert [(row["id"], row["name"]) for row in found["routes"]] == [(moon, "Moon")]
    assert (found["plan"]["routes"], found["plan"]["signed_off"]) == (1, 0)
    ask(world, "PUT", f"/reset-plans/{key}/state", body={"state": "published"})
    ask(world, "POST", f"/routes/{moon}/strip")
    assert ask(world, "GET", f"/reset-plans/{key}")["plan"]["routes"] == 2  # its history
    assert plan(world).status_code == 201  # the wall's next reset
    states = [one["state"] for one in ask(world, "GET", "/reset-plans")]
    assert states == ["planned", "published"]
    ask(world, "PUT", f"/reset-plans/{key}/state", body={"state": "forerun"})
    assert ask(world, "GET", f"/reset-plans/{key}")["plan"]["published_at"] is None


def test_new_routes_of_a_review_are_forerun_before_the_publication(world: World, font: str) -> None:
    key = planned(world, forerunners=[str(world.people["member"].id)])
    scan = world.reviewed({1: [1], 2: [2]}, [hold(1, 0.0, 1.0), hold(2, 1.0, 1.0)])
    # The review adds its new routes by hand; a repeated request adds nothing.
    moon = str(uuid4())
    body = {"routes": [{"id": moon, "name": "Moon", "colour": "red", "strip_on": None}]}
    for _ in range(2):
        ask(world, "POST", f"/walls/{world.wall.id}/routes", body=body)
    path, grade = f"/reset-plans/{key}/routes/{moon}", {"grade_system_id": font, "grade": "6B"}
    (to_climb,) = ask(world, "GET", f"/reset-plans/{key}/forerun", "member")["routes"]
    assert to_climb["id"] == moon
    ask(world, "PUT", f"{path}/proposal", "member", grade)
    ask(world, "PUT", f"{path}/sign-off", body=grade)
    draft = ask(world, "GET", f"/scans/{scan}/draft")
    (unplaced,) = draft["unplaced"]
    assert (unplaced["id"], unplaced["grade"]) == (moon, "6B")
    entry = {"number": 1, "route_id": moon, "name": "Moon"} | grade
    answer = world.publish(scan, entry, {"number": 2, "name": "Sun"}, revision=draft["revision"])
    assert answer.is_success, answer.text
    routes = {route["name"]: route for route in world.published()["routes"]}
    assert (routes["Moon"]["id"], routes["Moon"]["number"]) == (moon, 1)
    assert routes["Moon"]["grade"] == "6B"
    found = {row["name"]: row for row in ask(world, "GET", f"/reset-plans/{key}")["routes"]}
    assert found["Moon"]["sign_off"]["grade"] == "6B"
    assert [one["grade"] for one in found["Moon"]["proposals"]] == ["6B"]


def test_a_published_scan_closes_the_plan_and_an_amendment_does_not(world: World) -> None:
    first = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    key = planned(world)
    early = planned(make_world(world.server, world.people), day="2020-01-01")
    assert early != key
    with world.server.database.writing() as session:  # begun before the plan's day
        scan = session.get_one(Scan, first)
        scan.created_at -= timedelta(days=2)
    assert world.publish(first, {"number": 1, "name": "Moon"}).is_success
    assert ask(world, "GET", f"/reset-plans/{key}")["plan"]["state"] == "planned"
    amended = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)], amends_id=first)
    route = world.published()["routes"][0]["id"]
    assert world.publish(amended, {"number": 1, "route_id": route}, revision=1).is_success
    assert ask(world, "GET", f"/reset-plans/{key}")["plan"]["state"] == "planned"
    reset = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(reset, {"number": 1, "name": "Sun"}, revision=2).is_success
    found = ask(world, "GET", f"/reset-plans/{key}")
    assert found["plan"]["state"] == "published"
    assert "Sun" in {row["name"] for row in found["routes"]}
    path = f"{world.path}/reset-plans/{key}/state"
    refused = world.server.ask("PUT", path, world.people["setter"], {"state": "set"})
    assert (refused.status_code, refused.json()["code"]) == (409, "reset-published")


def test_forerunners_propose_and_do_not_see_each_other(world: World, font: str) -> None:
    key = planned(world, forerunners=[str(world.people["member"].id)])
    moon = by_hand(world, "Moon")
    path = f"/reset-plans/{key}/routes/{moon}/proposal"
    words = {"grade_system_id": font, "grade": "6A", "risk": 2, "complexity": 4, "note": "Sharp"}
    for _ in range(2):
        assert ask(world, "PUT", path, "member", words)["grade"] == "6A"
    ask(world, "PUT", path, "member", words | {"grade": "6B"})
    ask(world, "PUT", path, "setter", {"grade_system_id": font, "grade": "6C", "risk": 3})
    ask(world, "PUT", path, "owner", {"note": "Great"})
    [mine] = ask(world, "GET", f"/reset-plans/{key}/forerun", "member")["routes"]
    assert (mine["own"]["grade"], mine["own"]["note"]) == ("6B", "Sharp")
    assert "proposals" not in mine
    [row] = ask(world, "GET", f"/reset-plans/{key}")["routes"]
    assert [one["person_name"] for one in row["proposals"]] == ["member", "setter", "owner"]
    assert row["median"] == {
        "proposals": 3,
        "grade_system_id": font,
        "grade": "6B",
        "risk": 2.5,
        "intensity": None,
        "complexity": 4.0,
    }
    ask(world, "DELETE", path, "member")
    [row] = ask(world, "GET", f"/reset-plans/{key}")["routes"]
    assert row["median"]["grade"] == "6C"
    wrong = ({"grade": "6A"}, {"grade_system_id": font, "grade": "12"}, {"risk": 6})
    for body in wrong:
        answer = world.server.ask("PUT", f"{world.path}{path}", world.owner, body)
        assert answer.status_code == 422


def test_an_event_names_the_forerunners_of_set_routes(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    events: list[RoutesToForerun] = []

    def listen(session: Session, event: RoutesToForerun) -> None:
        events.append(event)

    database = world.server.database
    monkeypatch.setattr(database, "listeners", {**database.listeners, RoutesToForerun: (listen,)})
    member, judge = person_id(world.people["member"]), person_id(world.people["judge"])
    key = planned(world, forerunners=[str(member)])
    assert events == []  # only planned
    ask(world, "PUT", f"/reset-plans/{key}/state", body={"state": "set"})
    plan(world, key=UUID(key), forerunners=[str(member), str(judge)])
    assert [event.forerunners for event in events] == [{member}, {member, judge}]
    ask(world, "PUT", f"/reset-plans/{key}/state", body={"state": "forerun"})
    assert {(event.gym, event.wall) for event in events} == {(world.gym.id, world.wall.id)}
    assert len(events) == 2


def test_members_whom_no_plan_names_see_none(world: World) -> None:
    key, moon = planned(world, forerunners=[str(world.people["judge"].id)]), by_hand(world, "Moon")
    path = f"{world.path}/reset-plans/{key}"
    member = world.people["member"]
    assert ask(world, "GET", "/reset-plans", "member") == []
    assert [one["id"] for one in ask(world, "GET", "/reset-plans", "judge")] == [key]
    for method, part, body in (
        ("GET", "/forerun", None),
        ("PUT", f"/routes/{moon}/proposal", {"risk": 1}),
        ("DELETE", f"/routes/{moon}/proposal", None),
    ):
        answer = world.server.ask(method, path + part, member, body)
        assert (answer.status_code, answer.json()["code"]) == (403, "reset-not-named")
    old = by_hand(world, "Old", set_on="2020-01-01")  # no route of the plan
    gone = world.server.ask("PUT", f"{path}/routes/{old}/proposal", world.owner, {"risk": 1})
    assert gone.status_code == 404


def test_sign_off_writes_the_grade_and_is_logged(world: World, font: str) -> None:
    key, moon = planned(world), by_hand(world, "Moon")
    path = f"/reset-plans/{key}/routes/{moon}/sign-off"
    agreed = {"grade_system_id": font, "grade": "6B"}
    row = ask(world, "PUT", path, "setter", agreed)
    assert (row["grade"], row["sign_off"]["grade"]) == ("6B", "6B")
    assert row["sign_off"]["person_name"] == "setter"
    ask(world, "PUT", path, "owner", agreed)  # nothing changes but the signer
    known = ask(world, "GET", f"/routes/{moon}")
    assert (known["grade"], known["grade_system_id"]) == ("6B", font)
    assert ask(world, "GET", "/reset-plans")[0]["signed_off"] == 1
    refused = world.server.ask("PUT", f"{world.path}{path}", world.owner, agreed | {"grade": "12"})
    assert refused.json()["code"] == "grade-unknown"
    with world.server.database.reading() as session:
        mine = select(AuditEntry.action).where(AuditEntry.subject == moon)
        log = sorted(session.scalars(mine))
    assert log == ["reset.sign-off", "reset.sign-off", "route.change"]


def test_a_deleted_account_leaves_its_signature_without_a_name(world: World, font: str) -> None:
    person = world.server.person("Ida")
    world = World(world.server, world.gym, world.wall, world.people | {"ida": person})
    with world.server.database.writing() as session:
        add_member(session, world.gym.id, person_id(person), Role.SETTER, person_id(person))
    ida = [str(person.id)]
    key, moon = planned(world, setters=ida, forerunners=ida), by_hand(world, "Moon")
    path = f"/reset-plans/{key}/routes/{moon}"
    agreed = {"grade_system_id": font, "grade": "6A"}
    ask(world, "PUT", f"{path}/proposal", "ida", agreed)
    ask(world, "PUT", f"{path}/sign-off", "ida", agreed)
    data = world.server.ask("GET", "/me/data", person).json()
    assert {row["part"] for row in data["reset_plans"]} == {"setter", "forerunner"}
    assert [row["grade"] for row in data["grade_proposals"] + data["sign_offs"]] == ["6A", "6A"]
    with world.server.database.writing() as session:
        delete_account(session, person_id(person))
    found = ask(world, "GET", f"/reset-plans/{key}")
    assert (found["plan"]["setters"], found["plan"]["forerunners"]) == ([], [])
    [row] = found["routes"]
    assert (row["proposals"], row["median"]) == ([], None)
    assert (row["sign_off"]["grade"], row["sign_off"]["person_name"]) == ("6A", "")


def test_the_median_is_of_the_most_used_system() -> None:
    one, other = uuid4(), uuid4()
    systems = {one: ["5", "6A", "6B", "6C"], other: ["V1", "V2"]}

    def proposal(system: UUID | None, grade: str) -> GradeProposal:
        return GradeProposal(grade_system_id=system, grade=grade)

    votes = [proposal(one, "6C"), proposal(other, "V2"), proposal(one, "5"), proposal(None, "")]
    found = median_of(votes, systems)
    assert found is not None
    assert (found.proposals, found.grade_system_id, found.grade) == (4, one, "5")
    lost = median_of([proposal(one, "9Z")], systems)  # a label that the gym has removed
    assert lost is not None
    assert (lost.grade, lost.risk) == ("", None)
    assert median_of([], systems) is None


def test_the_wishes_are_what_the_targets_lack_without_the_wall(world: World, font: str) -> None:
    by_hand(world, "Moon", grade_system_id=font, grade="6A")
    cells = [
        {"system": font, "grade": "6A", "routes": 2},
        {"system": font, "grade": "6B", "routes": 0},
        {"steepness": "slab", "routes": 9},
    ]
    ask(world, "PUT", "/insights/targets", body={"cells": cells})
    lacking = [{"system": font, "grade": "6A", "routes": 2}]
    assert ask(world, "GET", f"/walls/{world.wall.id}/lacking-grades") == lacking
    other = ask(world, "POST", "/walls", body={"name": "Slab"})["id"]
    lacking[0]["routes"] = 1
    assert ask(world, "GET", f"/walls/{other}/lacking-grades") == lacking
