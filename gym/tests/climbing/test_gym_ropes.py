"""Routes on ropes: lines, results of their own, and boards apart from boulders."""

from __future__ import annotations

from typing import Any
from uuid import UUID, uuid4

import httpx
import pytest
from gym.tests.worlds import World, hold

from walltopo_gym.climbing.points import ONSIGHT
from walltopo_gym.clock import now

POINTS = [[0.0, 0.0, float(height)] for height in range(2, 8)]


def put_line(world: World, label: str, *belays: str, line: UUID | None = None) -> httpx.Response:
    body = {"label": label, "belays": belays or ["lead", "top-rope"], "points": POINTS}
    path = f"{world.path}/walls/{world.wall.id}/lines/{line or uuid4()}"
    return world.server.ask("PUT", path, world.people["setter"], body)


def add_route(world: World, name: str, line: str | None) -> httpx.Response:
    body = {"routes": [{"name": name, "line_id": line}]}
    path = f"{world.path}/walls/{world.wall.id}/routes"
    return world.server.ask("POST", path, world.people["setter"], body)


@pytest.fixture
def line(world: World) -> str:
    answer = put_line(world, "7")
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


@pytest.fixture
def route(world: World, line: str) -> str:
    answer = add_route(world, "Moon", line)
    assert answer.status_code == 201, answer.text
    return str(answer.json()[0]["id"])


def climb(world: World, route: str, kind: str, **words: Any) -> httpx.Response:
    body = {"route_id": route, "kind": kind, "climbed_at": now().isoformat()} | words
    path = f"{world.path}/ascents/{uuid4()}"
    return world.server.ask("PUT", path, world.people["member"], body)


def board(world: World, discipline: str) -> dict[str, Any]:
    path = f"{world.path}/board?discipline={discipline}"
    found: dict[str, Any] = world.server.ask("GET", path, world.people["member"]).json()
    return found


def test_a_line_is_stored_once_and_shown(world: World, line: str) -> None:
    path = f"{world.path}/walls/{world.wall.id}/lines"
    assert put_line(world, "7", line=UUID(line)).status_code == 200
    [shown] = world.server.ask("GET", path, world.people["member"]).json()
    assert (shown["label"], shown["belays"]) == ("7", ["lead", "top-rope"])
    assert shown["points"] == POINTS
    assert put_line(world, "7").json()["code"] == "line-label-taken"
    assert put_line(world, "8", "lead", "lead").json()["belays"] == ["lead"]
    assert put_line(world, "9", "free-solo").status_code == 422


def test_a_line_with_routes_stays(world: World, line: str, route: str) -> None:
    setter = world.people["setter"]
    path = f"{world.path}/walls/{world.wall.id}/lines/{line}"
    refused = world.server.ask("DELETE", path, setter)
    assert (refused.status_code, refused.json()["code"]) == (409, "line-has-routes")
    assert climb(world, route, "top").status_code == 201
    strip = f"{world.path}/routes/{route}/strip"
    assert world.server.ask("POST", strip, setter).is_success
    assert world.server.ask("DELETE", path, setter).status_code == 204
    assert world.server.ask("DELETE", path, setter).status_code == 404
    # Its climbs stay, and so does their board.
    assert board(world, "lead")["disciplines"] == ["boulder", "lead", "top-rope"]
    assert board(world, "lead")["own"]["tops"] == 1
    assert add_route(world, "Sun", line).json()["code"] == "not-there-line"


def test_a_line_of_another_wall_is_refused(world: World, line: str, route: str) -> None:
    setter = world.people["setter"]
    wall = world.server.ask("POST", f"{world.path}/walls", setter, {"name": "Slab"}).json()["id"]
    body = {"routes": [{"name": "Sun", "line_id": line}]}
    answer = world.server.ask("POST", f"{world.path}/walls/{wall}/routes", setter, body)
    assert answer.json()["code"] == "not-there-line"


def test_a_route_is_moved_to_and_from_a_line(world: World, line: str, route: str) -> None:
    setter, path = world.people["setter"], f"{world.path}/routes/{route}"
    shown = world.server.ask("GET", path, setter).json()
    assert shown["line"] == {"id": line, "label": "7"}
    assert shown["disciplines"] == ["lead", "top-rope"]
    boulder = world.server.ask("PATCH", path, setter, {"line_id": None}).json()
    assert (boulder["line"], boulder["disciplines"]) == (None, ["boulder"])
    again = world.server.ask("PATCH", path, setter, {"line_id": line}).json()
    assert again["line"]["label"] == "7"
    assert (
        world.server.ask("PATCH", path, setter, {"line_id": str(uuid4())}).json()["code"]
        == "not-there-line"
    )


def test_a_publication_puts_a_route_on_a_line(world: World, line: str) -> None:
    scan = world.reviewed({1: [1, 2]}, [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4)])
    entry = {"number": 1, "name": "Moon", "line_id": line}
    assert world.publish(scan, entry, revision=1).is_success
    assert world.published()["routes"][0]["line"]["label"] == "7"


def test_a_table_names_lines_by_their_labels(world: World, line: str) -> None:
    path = f"{world.path}/walls/{world.wall.id}/routes/import"
    body = {"id": str(uuid4()), "csv": "name,line\nMoon,7\nSun,\nMars,99\n", "really": False}
    answer = world.server.ask("POST", path, world.people["setter"], body).json()
    assert [row["name"] for row in answer["routes"]] == ["Moon", "Sun"]
    assert [(fault["column"], fault["line"]) for fault in answer["errors"]] == [("line", 4)]
    body |= {"really": True, "without_wrong": True}
    world.server.ask("POST", path, world.people["setter"], body)
    there = world.server.ask(
        "GET", f"{world.path}/walls/{world.wall.id}/routes", world.people["member"]
    ).json()
    labels = {row["name"]: row["line"] and row["line"]["label"] for row in there}
    assert labels == {"Moon": "7", "Sun": None}


@pytest.mark.parametrize(
    ("kind", "words", "code"),
    [
        ("onsight", {}, None),
        ("flash", {"discipline": "top-rope"}, None),
        ("repeat", {}, None),
        ("hang", {"tries": 2}, None),
        ("high-point", {"high_point": 4}, None),
        ("onsight", {"tries": 2}, "flash-one-try"),
        ("zone", {}, "ascent-kind"),
        ("high-point", {}, "ascent-high-point"),
        ("top", {"high_point": 4}, "ascent-high-point"),
        ("top", {"discipline": "auto-belay"}, "ascent-discipline"),
        ("top", {"discipline": "boulder"}, "ascent-discipline"),
    ],
)
def test_a_result_fits_the_discipline(
    world: World, route: str, kind: str, words: dict[str, Any], code: str | None
) -> None:
    answer = climb(world, route, kind, **words)
    assert answer.json().get("code") == code, answer.text
    if code is None:
        assert answer.json()["discipline"] == words.get("discipline", "lead")


def test_a_boulder_has_no_results_of_ropes(world: World) -> None:
    boulder = add_route(world, "Rock", None).json()[0]["id"]
    for kind in ("onsight", "repeat", "hang"):
        assert climb(world, boulder, kind).json()["code"] == "ascent-kind"
    assert climb(world, boulder, "top").json()["discipline"] == "boulder"


def test_boards_and_progress_tell_disciplines_apart(world: World, route: str) -> None:
    boulder = add_route(world, "Rock", None).json()[0]["id"]
    climb(world, boulder, "top", tries=2)
    climb(world, route, "onsight")
    climb(world, route, "top", discipline="top-rope")
    boards = {one: board(world, one)["own"] for one in ("boulder", "lead", "top-rope")}
    assert {one: own["tops"] for one, own in boards.items()} == dict.fromkeys(boards, 1)
    assert boards["lead"]["points"] == boards["top-rope"]["points"] + ONSIGHT
    assert boards["lead"]["flashes"] == 1
    # Both ropes from above are one board.
    assert board(world, "auto-belay")["own"] == boards["top-rope"]
    for one in boards:
        path = f"{world.path}/progress?discipline={one}"
        progress = world.server.ask("GET", path, world.people["member"]).json()
        assert (progress["routes"], progress["ascents"]) == (1, 1)
        assert progress["disciplines"] == ["boulder", "lead", "top-rope"]


def test_a_gym_without_ropes_has_one_board(world: World) -> None:
    assert board(world, "boulder")["disciplines"] == ["boulder"]


def test_a_correction_changes_the_discipline(world: World, route: str) -> None:
    member = world.people["member"]
    ascent = climb(world, route, "high-point", high_point=3).json()["id"]
    path = f"/me/ascents/{ascent}"
    changed = world.server.ask("PATCH", path, member, {"kind": "top", "discipline": "top-rope"})
    assert changed.json()["discipline"] == "top-rope", changed.text
    assert changed.json()["high_point"] is None
    assert board(world, "lead")["own"] is None
    assert board(world, "top-rope")["own"]["tops"] == 1
    refused = world.server.ask("PATCH", path, member, {"discipline": "boulder"})
    assert refused.json()["code"] == "ascent-discipline"


def test_the_log_says_how_a_route_was_climbed(world: World, route: str) -> None:
    climb(world, route, "hang")
    member = world.people["member"]
    [month] = world.server.ask("GET", "/me/log", member).json()["months"]
    entries = world.server.ask("GET", f"/me/log/months/{month['month']}", member).json()
    assert [(entry["discipline"], entry["kind"]) for entry in entries] == [("lead", "hang")]
