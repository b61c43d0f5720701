"""Lists of routes and problems: stored once, shared, done together by consent, moderated."""

from __future__ import annotations

from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.worlds import World, hold, make_world

from walltopo_gym.accounts import limits
from walltopo_gym.accounts.limits import Limit
from walltopo_gym.clock import now
from walltopo_gym.operating.own_data import delete_account

pytestmark = pytest.mark.both_databases("search and paging in SQL")

HOLDS = [hold(n, 0.5 * n, 1.0) for n in range(1, 5)]


@pytest.fixture
def scan(world: World) -> UUID:
    """A published version with two routes."""
    made = world.reviewed({1: [1, 2], 2: [3, 4]}, HOLDS)
    assert world.publish(made, {"number": 1, "name": "Moon"}, {"number": 2}).is_success
    return made


@pytest.fixture
def items(world: World, scan: UUID) -> list[str]:
    """Ids of the two routes and of a problem of "judge" that all members see."""
    rows = world.server.ask("GET", f"{world.path}/routes", world.people["member"]).json()
    return [*(row["id"] for row in rows), put_problem(world, scan, "gym")]


def put_problem(world: World, scan: UUID, share: str) -> str:
    key = str(uuid4())
    holds = [{"hold": 1, "use": "start"}, {"hold": 3, "use": "top"}]
    body = {"wall_id": str(world.wall.id), "scan_id": str(scan), "holds": holds, "name": share}
    path = f"{world.path}/problems/{key}"
    answer = world.server.ask("PUT", path, world.people["judge"], body | {"share": share})
    assert answer.status_code == 201, answer.text
    return key


def put(world: World, who: str, items: list[str], key: object = None, **facts: Any) -> Any:
    path = f"{world.path}/lists/{key or uuid4()}"
    body = {"name": "Warm-up", "share": "gym", "items": items} | facts
    return world.server.ask("PUT", path, world.people[who], body)


def read(world: World, who: str, key: object, part: str = "") -> Any:
    return world.server.ask("GET", f"{world.path}/lists/{key}{part}", world.people[who])


def names(world: World, who: str) -> list[str]:
    answer = world.server.ask("GET", f"{world.path}/lists", world.people[who])
    assert answer.status_code == 200, answer.text
    return [row["name"] for row in answer.json()["items"]]


def tick(world: World, who: str, route: str, kind: str = "top") -> None:
    body = {"route_id": route, "kind": kind, "climbed_at": now().isoformat()}
    path = f"{world.path}/ascents/{uuid4()}"
    assert world.server.ask("PUT", path, world.people[who], body).is_success


def refusal(answer: Any) -> str:
    assert not answer.is_success
    code: str = answer.json()["code"]
    return code


def test_a_list_is_stored_once_in_its_order(world: World, items: list[str]) -> None:
    key = uuid4()
    first = put(world, "member", items, key)
    assert first.status_code == 201, first.text
    kinds = ("route", "route", "problem")
    found = [(one["id"], one["kind"]) for one in first.json()["items"]]
    assert found == list(zip(items, kinds, strict=True))
    assert first.json()["items"][0]["name"] == "Moon"
    assert put(world, "member", items[::-1], key, name="Cool-down").status_code == 200
    assert put(world, "judge", items, key).status_code == 409
    after = read(world, "judge", key).json()
    assert (after["name"], after["author"], after["climbs"]) == ("Cool-down", "member", items[::-1])
    assert [one["id"] for one in after["items"]] == items[::-1]


def test_a_late_copy_changes_and_revives_nothing(world: World, items: list[str]) -> None:
    key, device = uuid4(), str(uuid4())
    newer, older = ({"device": device, "number": n, "age_s": 0} for n in (2, 1))
    put(world, "member", items, key, name="New", edit=newer)
    assert put(world, "member", items, key, name="Old", edit=older).json()["name"] == "New"
    path = f"/me/lists/{key}"
    assert world.server.ask("DELETE", path, world.people["judge"]).status_code == 404
    assert world.server.ask("DELETE", path, world.people["member"]).is_success
    late = put(world, "member", items, key, name="New")
    assert (late.status_code, late.json()["items"]) == (200, [])
    assert (read(world, "member", key).status_code, names(world, "member")) == (404, [])


def test_items_are_climbs_of_this_gym_that_the_author_sees(
    world: World, scan: UUID, items: list[str]
) -> None:
    route = items[0]
    assert refusal(put(world, "member", [route, route])) == "list-item-twice"
    assert refusal(put(world, "member", [route, str(uuid4())])) == "list-item-unknown"
    other = make_world(world.server)
    assert refusal(put(other, "member", [route])) == "list-item-unknown"
    private = put_problem(world, scan, "private")
    assert refusal(put(world, "member", [private])) == "list-item-unknown"
    mine = put(world, "judge", [private, route])
    assert mine.status_code == 201
    seen = read(world, "member", mine.json()["id"]).json()["items"]
    assert [(one["kind"], one["name"]) for one in seen] == [("gone", ""), ("route", "Moon")]


def test_what_is_gone_stays_in_a_list_and_does_not_block_it(world: World, items: list[str]) -> None:
    key = uuid4()
    put(world, "member", items, key)
    setter, judge = world.people["setter"], world.people["judge"]
    assert world.server.ask("POST", f"{world.path}/routes/{items[0]}/strip", setter).is_success
    assert world.server.ask("DELETE", f"/me/problems/{items[2]}", judge).is_success
    found = [(one["kind"], one["current"]) for one in read(world, "member", key).json()["items"]]
    assert found == [("route", False), ("route", True), ("gone", False)]
    assert put(world, "member", items, key, name="Again").status_code == 200


def test_people_see_lists_by_their_share(world: World, items: list[str]) -> None:
    keys = {
        share: put(world, "member", items, name=share, share=share).json()["id"]
        for share in ("private", "link", "gym")
    }
    seen = {
        who: {share for share, key in keys.items() if read(world, who, key).is_success}
        for who in ("member", "judge", "stranger", "nobody")
    }
    assert seen["member"] == set(keys)
    assert seen["judge"] == {"link", "gym"}
    assert seen["stranger"] == seen["nobody"] == set()  # the gym is private
    assert names(world, "member") == ["gym", "link", "private"]
    assert names(world, "judge") == ["gym"]
    join = f"{world.path}/lists/{keys['link']}/joined"
    assert world.server.ask("PUT", join, world.people["judge"], {}).is_success
    assert names(world, "judge") == ["gym", "link"]


def test_a_list_counts_what_one_has_climbed(world: World, items: list[str]) -> None:
    key = put(world, "member", items).json()["id"]
    tick(world, "judge", items[0])
    tick(world, "judge", items[1], "try")
    climbed = f"{world.path}/problems/{items[2]}/climbed"
    body = {"climbed_at": now().isoformat()}
    assert world.server.ask("PUT", climbed, world.people["judge"], body).is_success
    found = read(world, "judge", key).json()
    assert [one["climbed_at"] is not None for one in found["items"]] == [True, False, True]
    assert (found["climbed"], read(world, "member", key).json()["climbed"]) == (2, 0)


def test_an_author_sees_the_progress_of_those_who_consent(world: World, items: list[str]) -> None:
    key = put(world, "member", items).json()["id"]
    join = f"{world.path}/lists/{key}/joined"
    for who, shows in (("judge", True), ("setter", False)):
        tick(world, who, items[0])
        body = {"shows_progress": shows}
        assert world.server.ask("PUT", join, world.people[who], body).is_success
    assert read(world, "judge", key).json()["shows_progress"]
    judge = {"person_id": str(world.people["judge"].id), "name": "judge", "climbed": [items[0]]}
    assert read(world, "member", key, "/progress").json() == [judge]
    assert read(world, "judge", key, "/progress").status_code == 404
    assert world.server.ask("PUT", join, world.people["judge"], {}).is_success
    assert read(world, "member", key, "/progress").json() == []
    assert world.server.ask("DELETE", join, world.people["judge"]).is_success
    assert not read(world, "judge", key).json()["joined"]


def test_setters_make_circuits_and_hide_lists(world: World, items: list[str]) -> None:
    assert refusal(put(world, "member", items, circuit=True)) == "list-circuit-setter"
    assert put(world, "setter", items, circuit=True).json()["circuit"]
    key = put(world, "member", items, name="Rude").json()["id"]
    hidden = f"{world.path}/lists/{key}/hidden"
    assert world.server.ask("PUT", hidden, world.people["setter"]).is_success
    assert (names(world, "judge"), names(world, "member")) == (["Warm-up"], ["Rude", "Warm-up"])
    assert read(world, "judge", key).status_code == 404
    assert read(world, "setter", key).json()["hidden"]
    assert world.server.ask("DELETE", hidden, world.people["setter"]).is_success
    assert names(world, "judge") == ["Rude", "Warm-up"]


def test_a_limit_of_a_day(world: World, items: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "_LISTS", Limit("list", 1, 86400))
    assert put(world, "member", items).status_code == 201
    assert put(world, "member", items).status_code == 429


def test_ones_own_data_and_the_end_of_an_account(world: World, items: list[str]) -> None:
    key = put(world, "judge", items).json()["id"]
    data = world.server.ask("GET", "/me/data", world.people["judge"]).json()
    assert [row["id"] for row in data["lists"]] == [key]
    judge = world.people["judge"].id
    assert judge is not None
    with world.server.database.writing() as session:
        delete_account(session, judge)
    assert read(world, "member", key).status_code == 404
