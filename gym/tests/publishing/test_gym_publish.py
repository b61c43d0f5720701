"""Publishing: a reset from the first wall to the next, two setters at once, and the way back."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
from gym.tests.worlds import World, hold
from sqlalchemy import func, select
from tests.at_once import at_once

from walltopo_gym.gyms.models import GRADE_BY
from walltopo_gym.migrations.tables import METADATA
from walltopo_gym.publishing.models import Placement, Route

COLOURS: dict[str, Any] = {
    "name": "Colours",
    "kind": "own",
    "grades": [{"label": "blue"}, {"label": "red"}],
}
HOLDS = [hold(n, 0.5 * n, 1.0 + 0.1 * (n % 3)) for n in range(1, 13)]
FIRST = {1: [1, 2, 3, 4], 2: [5, 6, 7, 8], 3: [9, 10, 11, 12]}


@pytest.fixture
def current(world: World) -> tuple[World, dict[str, Any]]:
    """A wall with three named routes."""
    scan = world.reviewed(FIRST, HOLDS)
    entries = [{"number": n, "name": f"Route {n}"} for n in FIRST]
    assert world.publish(scan, *entries).status_code == 200
    return world, world.published()


def draft(world: World, scan: object) -> dict[str, Any]:
    answer = world.server.ask("GET", f"{world.path}/scans/{scan}/draft", world.people["setter"])
    assert answer.status_code == 200, answer.text
    payload: dict[str, Any] = answer.json()
    return payload


def test_a_reset_keeps_what_stays(current: tuple[World, dict[str, Any]]) -> None:
    world, before = current
    ids = {route["name"]: route["id"] for route in before["routes"]}
    # Route 2 is gone, 4 is new, the others stay under other numbers.
    new = [*HOLDS[:4], *HOLDS[8:], *(hold(n, 0.5 * n, 2.6) for n in range(20, 24))]
    scan = world.reviewed({1: [20, 21, 22, 23], 2: [9, 10, 11, 12], 3: [1, 2, 3, 4]}, new)
    table = draft(world, scan)
    fates = [(line["fate"], line["number"], line["route_id"]) for line in table["lines"]]
    assert fates == [
        ("new", 1, None),
        ("kept", 2, ids["Route 3"]),
        ("kept", 3, ids["Route 1"]),
        ("stripped", None, ids["Route 2"]),
    ]
    entries = [
        {"number": line["number"], "route_id": line["route_id"]}
        | ({"name": "New"} if line["fate"] == "new" else {})
        for line in table["lines"]
        if line["number"] is not None
    ]
    assert world.publish(scan, *entries, revision=table["revision"]).status_code == 200
    after = {route["name"]: route for route in world.published()["routes"]}
    assert set(after) == {"New", "Route 1", "Route 3"}
    assert after["Route 1"]["id"] == ids["Route 1"]
    assert after["Route 3"]["holds"] == [9, 10, 11, 12]
    gone = f"{world.path}/routes/{ids['Route 2']}"
    assert world.server.ask("GET", gone, world.people["member"]).json()["stripped_at"] is not None


def test_the_former_version_comes_back(current: tuple[World, dict[str, Any]]) -> None:
    world, before = current
    assert world.publish(world.reviewed({}, []), revision=1).status_code == 200
    assert world.published()["routes"] == []
    body = {"scan_id": before["scan_id"], "revision": 2}
    path = f"{world.path}/walls/{world.wall.id}/put-back"
    assert world.server.ask("POST", path, world.owner, body).status_code == 200
    again = world.published()
    assert [r["id"] for r in again["routes"]] == [r["id"] for r in before["routes"]]
    assert again["revision"] == 3


def test_of_two_setters_one_publishes(current: tuple[World, dict[str, Any]]) -> None:
    world, _ = current
    scans = [world.reviewed({1: [1]}, HOLDS[:1]) for _ in range(2)]

    def publish(scan: Any) -> int:
        return world.publish(scan, {"number": 1}, revision=1).status_code

    statuses = at_once(*(partial(publish, scan) for scan in scans))
    assert sorted(statuses) == [200, 409]
    assert len(world.published()["routes"]) == 1


@pytest.mark.parametrize(
    "entries",
    [
        [{"number": 1}, {"number": 99}],
        [{"number": 1}, {"number": 1}],
        [{"number": 1, "route_id": "00000000-0000-0000-0000-000000000000"}],
        [{"number": 1, "grade": "6A"}],
    ],
)
def test_what_makes_no_sense_changes_nothing(
    current: tuple[World, dict[str, Any]], entries: list[dict[str, Any]]
) -> None:
    world, before = current
    scan = world.reviewed({1: [1]}, HOLDS[:1])
    assert world.publish(scan, *entries, revision=1).status_code == 422
    assert world.published() == before
    with world.server.database.reading() as session:
        placed = select(func.count()).select_from(Placement).where(Placement.scan_id == scan)
        assert session.scalar(placed) == 0
        routes = select(func.count()).select_from(Route).where(Route.wall_id == world.wall.id)
        assert session.scalar(routes) == 3


def test_a_wall_that_did_not_change_is_not_sent_again(
    current: tuple[World, dict[str, Any]],
) -> None:
    world, before = current
    member, path = world.people["member"], f"{world.path}/walls/{world.wall.id}/published"
    tag = world.server.ask("GET", path, member).headers["etag"]
    answer = world.server.ask("GET", path, member, headers={"if-none-match": tag})
    assert (answer.status_code, answer.content) == (304, b"")
    strip = f"{world.path}/routes/{before['routes'][0]['id']}/strip"
    assert world.server.ask("POST", strip, world.people["setter"]).status_code == 200
    assert world.server.ask("POST", strip, world.people["setter"]).status_code == 409
    answer = world.server.ask("GET", path, member, headers={"if-none-match": tag})
    assert (answer.status_code, len(answer.json()["routes"])) == (200, 2)


def test_a_wall_whose_grades_were_renamed_is_sent_again(
    current: tuple[World, dict[str, Any]],
) -> None:
    """Grades, names and setters change without the wall's revision."""
    world, before = current
    system = world.server.ask("GET", f"{world.path}/grade-systems", world.owner).json()[0]
    own = {"name": "Ours", "kind": "own", "grades": [{"label": "easy"}, {"label": "hard"}]}
    made = world.server.ask("POST", f"{world.path}/grade-systems", world.owner, own).json()
    assert system["id"] != made["id"]
    graded = {"grade_system_id": made["id"], "grade": "hard"}
    route = f"{world.path}/routes/{before['routes'][0]['id']}"
    assert world.server.ask("PATCH", route, world.people["setter"], graded).is_success
    member, path = world.people["member"], f"{world.path}/walls/{world.wall.id}/published"
    tag = world.server.ask("GET", path, member).headers["etag"]
    grades = [{"label": "easy"}, {"label": "stern"}]
    renamed = own | {"grades": grades, "renamed": {"hard": "stern"}}
    changed = world.server.ask(
        "PUT", f"{world.path}/grade-systems/{made['id']}", world.owner, renamed
    )
    assert changed.status_code == 200, changed.text
    answer = world.server.ask("GET", path, member, headers={"if-none-match": tag})
    assert answer.status_code == 200
    assert "stern" in {row["grade"] for row in answer.json()["routes"]}


def test_grades_are_the_gyms(current: tuple[World, dict[str, Any]]) -> None:
    world, before = current
    system = world.server.ask("GET", f"{world.path}/grade-systems", world.owner).json()[0]["id"]
    route = f"{world.path}/routes/{before['routes'][0]['id']}"
    for grade, status in (("6A", 200), ("V4", 422)):
        body = {"grade_system_id": system, "grade": grade}
        answer = world.server.ask("PATCH", route, world.people["setter"], body)
        assert answer.status_code == status, answer.text
    assert world.server.ask("GET", route, world.owner).json()["grade"] == "6A"


@pytest.mark.parametrize(
    ("kind", "labels", "own", "written"),
    [
        ("font", ["4", "5a", "5B", "5C", "6A", "6a+/6b"], "6A+/6B", "6a+ / 6B"),
        ("font", ["6A", "6A+"], "6A", "6a"),
        ("v", ["VB", "V0", "V4-5"], "V4-5", "v4/5"),
        ("french", ["5c", "6A", "6a+"], "6a", "6A"),
        ("uiaa", ["V+", "VI-", "VI+"], "VI+", "6+"),
        ("uiaa", ["5+", "6-", "6+"], "6+", "VI+"),
        ("own", ["Grün"], "Grün", "grün"),
    ],
)
def test_a_written_grade_gets_the_label_of_its_system(
    current: tuple[World, dict[str, Any]], kind: str, labels: list[str], own: str, written: str
) -> None:
    world, before = current
    body = {"name": "Ours", "kind": kind, "grades": [{"label": label} for label in labels]}
    made = world.server.ask("POST", f"{world.path}/grade-systems", world.owner, body)
    assert made.status_code == 201, made.text
    system = made.json()["id"]
    route = f"{world.path}/routes/{before['routes'][0]['id']}"
    graded = {"grade_system_id": system, "grade": written}
    answer = world.server.ask("PATCH", route, world.people["setter"], graded)
    assert answer.json()["grade"] == own
    wrong = graded | {"grade": "6Z"}
    answer = world.server.ask("PATCH", route, world.people["setter"], wrong)
    assert (answer.status_code, answer.json()["code"]) == (422, "grade-unknown")
    opinion = {"grade": written}
    member = world.people["member"]
    assert world.server.ask("PUT", f"{route}/opinion", member, opinion).status_code == 204
    assert world.server.ask("GET", f"{route}/opinion", member).json()["grade"] == own


@pytest.mark.parametrize(
    ("kind", "labels", "code"),
    [
        ("font", ["6A", "V4"], "grades-unknown"),
        ("font", ["6A", "6a"], "grades-twice"),
        ("uiaa", ["VI+", "6+"], "grades-twice"),
        ("font", ["6A+/6B", "6A+"], "grades-order"),
        ("french", ["6"], "grades-unknown"),
    ],
)
def test_a_scale_refuses_other_grades(
    world: World, kind: str, labels: list[str], code: str
) -> None:
    body = {"name": "Ours", "kind": kind, "grades": [{"label": label} for label in labels]}
    made = world.server.ask("POST", f"{world.path}/grade-systems", world.owner, body)
    assert (made.status_code, made.json()["code"]) == (422, code)


def test_a_circuits_range_is_spelled_as_its_scale_does(world: World) -> None:
    grades = [{"label": "Blue", "low": "6a", "high": "6b+"}]
    body = {"name": "Colours", "kind": "circuits", "grades": grades}
    made = world.server.ask("POST", f"{world.path}/grade-systems", world.owner, body).json()
    assert (made["grades"][0]["low"], made["grades"][0]["high"]) == ("6A", "6B+")


def test_every_column_of_grades_is_found_by_renames() -> None:
    """Ascents, competitions and their problems keep the grade of their day; others keep a text."""
    kept = {"ascents", "competition_problems", "other_ascents"}
    for table in METADATA.sorted_tables:
        if "grade" in table.c and table.name not in kept:
            assert GRADE_BY in table.c.grade.info, table.name


@pytest.mark.both_databases("updates of rows inside of JSON")
def test_grades_of_plans_and_opinions_are_in_use_too(
    current: tuple[World, dict[str, Any]],
) -> None:
    world, before = current
    ask, path = world.server.ask, f"{world.path}/grade-systems"
    system = ask("POST", path, world.owner, COLOURS).json()["id"]
    route = f"{world.path}/routes/{before['routes'][0]['id']}"
    graded = {"grade_system_id": system, "grade": "red"}
    assert ask("PATCH", route, world.people["setter"], graded).is_success
    assert ask("PUT", f"{route}/opinion", world.people["member"], {"grade": "blue"}).is_success
    target = {"system": system, "grade": "red", "routes": 3}
    wanted = {"cells": [target]}
    assert ask("PUT", f"{world.path}/insights/targets", world.owner, wanted).is_success
    lost = ask("PUT", f"{path}/{system}", world.owner, COLOURS | {"grades": [{"label": "red"}]})
    assert (lost.status_code, lost.json()["code"]) == (409, "grades-in-use")
    new = [{"label": "blue"}, {"label": "ruby"}]
    change = COLOURS | {"grades": new, "renamed": {"red": "ruby"}}
    assert ask("PUT", f"{path}/{system}", world.owner, change).is_success
    found = ask("GET", f"{world.path}/insights", world.owner).json()["targets"]
    assert [(row["grade"], row["target"]) for row in found if row["target"]] == [("ruby", 3)]
    by = ask("POST", path, world.owner, COLOURS | {"name": "More", "grades": new}).json()["id"]
    assert ask("DELETE", f"{path}/{system}?replacement={by}", world.owner).is_success
    found = ask("GET", f"{world.path}/insights", world.owner).json()["targets"]
    assert [(row["system"], row["grade"]) for row in found if row["target"]] == [(by, "ruby")]


@pytest.mark.both_databases("updates by subquery and case")
def test_renamed_grades_carry_over_and_used_ones_stay(
    current: tuple[World, dict[str, Any]],
) -> None:
    world, before = current
    ask, path = world.server.ask, f"{world.path}/grade-systems"
    system = ask("POST", path, world.owner, COLOURS).json()["id"]
    route = f"{world.path}/routes/{before['routes'][0]['id']}"
    setter = world.people["setter"]
    graded = {"grade_system_id": system, "grade": "blue"}
    assert ask("PATCH", route, setter, graded).status_code == 200
    opinion = {"grade": "blue", "stars": 4}
    assert ask("PUT", f"{route}/opinion", world.people["member"], opinion).status_code == 204

    lost = COLOURS | {"grades": [{"label": "azure"}, {"label": "red"}]}
    refused = ask("PUT", f"{path}/{system}", world.owner, lost)
    assert (refused.status_code, refused.json()["code"]) == (409, "grades-in-use")
    elsewhere = ask("PUT", f"{path}/{system}", world.owner, lost | {"renamed": {"blue": "sky"}})
    assert elsewhere.json()["code"] == "grades-rename-to"
    renamed = ask("PUT", f"{path}/{system}", world.owner, lost | {"renamed": {"blue": "azure"}})
    assert renamed.status_code == 200, renamed.text
    assert ask("GET", route, world.owner).json()["grade"] == "azure"
    mine = ask("GET", f"{route}/opinion", world.people["member"]).json()
    assert (mine["grade"], mine["stars"]) == ("azure", 4)
    assert ask("PATCH", route, setter, {"name": "Moon"}).status_code == 200

    used = ask("DELETE", f"{path}/{system}", world.owner)
    assert (used.status_code, used.json()["code"]) == (409, "grades-system-in-use")
    font = next(row["id"] for row in ask("GET", path, world.owner).json() if row["id"] != system)
    lacks = ask("DELETE", f"{path}/{system}?replacement={font}", world.owner)
    assert (lacks.status_code, lacks.json()["code"]) == (409, "grades-not-there")
    other = COLOURS | {"name": "More colours", "grades": [{"label": "Azure"}]}
    by = ask("POST", path, world.owner, other).json()["id"]
    assert ask("DELETE", f"{path}/{system}?replacement={by}", world.owner).status_code == 204
    shown = ask("GET", route, world.owner).json()
    assert (shown["grade_system_id"], shown["grade"]) == (by, "Azure")
    assert ask("PATCH", route, setter, {"name": "Sun"}).status_code == 200


def test_a_draft_is_for_setters(world: World) -> None:
    """Its files are not there for members before it is published."""
    scan = world.reviewed({1: [1]}, HOLDS[:1])
    path = f"{world.path}/scans/{scan}/files/index.html"
    assert world.server.ask("GET", path, world.people["member"]).status_code == 404
    assert world.server.ask("GET", path, world.people["setter"]).status_code == 200
    assert world.publish(scan, {"number": 1}).status_code == 200
    shown = world.server.ask("GET", path, world.people["member"])
    assert shown.status_code == 200
    assert "immutable" in shown.headers["cache-control"]
    assert "default-src 'none'" in shown.headers["content-security-policy"]
