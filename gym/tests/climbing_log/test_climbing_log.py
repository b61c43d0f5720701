"""One log of all climbs: of any gym, of gyms that are gone, and of anywhere else."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from uuid import uuid4

import httpx
import pytest
from gym.tests.climbing.test_gym_ascents import tick
from gym.tests.worlds import Somebody, World, hold

from walltopo_gym.clock import now

ELSEWHERE = {
    "venue": "outdoors",
    "discipline": "lead",
    "name": "Kauk",
    "location": "Frankenjura",
    "grade": "7b",
    "kind": "onsight",
    "note": "windy",
    "day": "2024-05-14",
}
CSV = (
    "climbed_at,gym_name,route_name,grade,kind,tries,note\n"
    "2023-01-02T18:00:00+00:00,Old hall,Blue one,6a,top,2,\n"
    "2023-01-02T18:05:00+00:00,Old hall,Blue one,6a,top,1,again\n"
    "2023-01-02T18:10:00+00:00,Old hall,Red one,6b,somersault,1,\n"
)


@pytest.fixture
def route(world: World) -> str:
    """A current route of red holds."""
    scan = world.reviewed({1: [1, 2]}, [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4)])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    found: str = world.published()["routes"][0]["id"]
    return found


def ask(world: World, method: str, path: str, body: Any = None, who: str = "member") -> Any:
    return world.server.ask(method, path, world.people[who], body)


def log_of(world: World, query: str = "", who: str = "member") -> list[dict[str, Any]]:
    """All entries of the log, the latest first."""
    entries = []
    for month in ask(world, "GET", f"/me/log{query}", who=who).json()["months"]:
        path = f"/me/log/months/{month['month']}{query}"
        found = ask(world, "GET", path, who=who).json()
        assert month["ascents"] == len(found)
        entries += found
    return entries


def put(world: World, ascent: Any, **changes: Any) -> httpx.Response:
    answer: httpx.Response = ask(world, "PUT", f"/me/log/others/{ascent}", ELSEWHERE | changes)
    return answer


def test_routes_and_climbs_elsewhere_are_one_log(world: World, route: str) -> None:
    here, there = uuid4(), uuid4()
    assert tick(world, here, route, note="slippery").status_code == 201
    assert put(world, there).status_code == 201
    first, last = log_of(world)
    assert (first["id"], first["origin"], first["current"]) == (str(here), "route", True)
    assert (first["gym"], first["wall"]) == (world.gym.slug, str(world.wall.id))
    assert (last["id"], last["origin"], last["day"]) == (str(there), "other", "2024-05-14")
    assert log_of(world, who="judge") == []


@pytest.mark.parametrize(
    ("query", "names"),
    [
        ("?location=Frankenjura", ["Kauk"]),
        ("?grade=7b", ["Kauk"]),
        ("?kind=top", ["Moon"]),
        ("?words=WINDY%20frank", ["Kauk"]),
        ("?words=mo", ["Moon"]),
        ("?words=nobody", []),
    ],
)
def test_filters(world: World, route: str, query: str, names: list[str]) -> None:
    assert tick(world, uuid4(), route).status_code == 201
    assert put(world, uuid4()).status_code == 201
    assert [entry["name"] for entry in log_of(world, query)] == names


def test_choices_are_of_the_whole_log(world: World, route: str) -> None:
    assert tick(world, uuid4(), route).status_code == 201
    assert put(world, uuid4()).status_code == 201
    overview = ask(world, "GET", "/me/log?kind=project").json()
    assert overview["months"] == []
    assert set(overview["choices"]["locations"]) == {world.gym.name, "Frankenjura"}
    assert set(overview["choices"]["kinds"]) == {"top", "onsight"}


def test_a_stripped_route_stays_and_so_does_a_deleted_gym(world: World, route: str) -> None:
    assert tick(world, uuid4(), route).status_code == 201
    setter = world.people["setter"]
    assert world.server.ask("POST", f"{world.path}/routes/{route}/strip", setter).is_success
    (entry,) = log_of(world)
    assert (entry["name"], entry["current"], entry["route"]) == ("Moon", False, route)
    assert world.server.ask("DELETE", world.path, world.owner).status_code == 204
    (entry,) = log_of(world)
    assert (entry["name"], entry["gym"], entry["route"]) == ("Moon", "", None)


def test_an_ascent_is_corrected_after_its_gym_is_gone(world: World, route: str) -> None:
    ascent = uuid4()
    assert tick(world, ascent, route).status_code == 201
    assert world.server.ask("DELETE", world.path, world.owner).status_code == 204
    day = now() - timedelta(days=400)
    change = {"kind": "flash", "climbed_at": day.isoformat(), "note": "of last year"}
    answer = ask(world, "PATCH", f"/me/ascents/{ascent}", change)
    assert answer.status_code == 200
    assert (answer.json()["kind"], answer.json()["tries"]) == ("flash", 1)
    assert [entry["note"] for entry in log_of(world)] == ["of last year"]


def test_a_correction_counts_in_sessions(world: World, route: str) -> None:
    ascent = uuid4()
    assert tick(world, ascent, route).status_code == 201
    path = f"{world.path}/sessions"
    assert [found["tops"] for found in ask(world, "GET", path).json()] == [1]
    assert ask(world, "PATCH", f"/me/ascents/{ascent}", {"kind": "try"}).status_code == 200
    assert [found["tops"] for found in ask(world, "GET", path).json()] == [0]


@pytest.mark.parametrize(
    ("change", "status", "code"),
    [
        ({"kind": "flash", "tries": 2}, 422, "flash-one-try"),
        ({"climbed_at": "2020-01-01T12:00:00Z"}, 422, "ascent-too-early"),
        ({"climbed_at": "2199-01-01T12:00:00Z"}, 422, "ascent-in-future"),
    ],
)
def test_a_correction_keeps_the_rules(
    world: World, route: str, change: dict[str, Any], status: int, code: str
) -> None:
    ascent = uuid4()
    assert tick(world, ascent, route).status_code == 201
    answer = ask(world, "PATCH", f"/me/ascents/{ascent}", change)
    assert (answer.status_code, answer.json()["code"]) == (status, code)


def test_nobody_corrects_anothers_ascent(world: World, route: str) -> None:
    ascent = uuid4()
    assert tick(world, ascent, route).status_code == 201
    assert ask(world, "PATCH", f"/me/ascents/{ascent}", {}, who="judge").status_code == 404
    assert ask(world, "DELETE", f"/me/ascents/{ascent}").status_code == 204
    assert ask(world, "PATCH", f"/me/ascents/{ascent}", {}).status_code == 404


def test_a_climb_elsewhere_is_stored_once_and_deleted_for_good(world: World) -> None:
    ascent = uuid4()
    assert [put(world, ascent).status_code for _ in range(2)] == [201, 204]
    assert put(world, ascent, grade="7b+").status_code == 204
    assert [entry["grade"] for entry in log_of(world)] == ["7b+"]
    path = f"/me/log/others/{ascent}"
    judge = ask(world, "PUT", path, ELSEWHERE, who="judge")
    assert (judge.status_code, judge.json()["code"]) == (409, "id-taken")
    assert ask(world, "DELETE", path, who="judge").status_code == 404
    assert [ask(world, "DELETE", path).status_code for _ in range(2)] == [204, 204]
    assert put(world, ascent).status_code == 204
    assert log_of(world) == []


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"tries": 3}, "flash-one-try"),
        ({"day": (now() + timedelta(days=3)).date().isoformat()}, "ascent-in-future"),
    ],
)
def test_an_impossible_climb_elsewhere_is_refused(
    world: World, change: dict[str, Any], code: str
) -> None:
    answer = put(world, uuid4(), **change)
    assert (answer.status_code, answer.json()["code"]) == (422, code)


def test_a_check_shows_each_line_and_adds_nothing(world: World) -> None:
    found = ask(world, "POST", "/me/log/import", {"text": CSV}).json()
    assert (found["source"], found["new"], found["added"], found["faulty"]) == ("walltopo", 2, 0, 1)
    assert [(line["name"], line["known"]) for line in found["lines"]] == [
        ("Blue one", False),
        ("Blue one", False),
    ]
    assert [(error["line"], error["code"]) for error in found["errors"]] == [(4, "log-style")]
    assert log_of(world) == []


def test_a_second_import_adds_nothing(world: World) -> None:
    body = {"text": CSV, "really": True}
    assert [ask(world, "POST", "/me/log/import", body).json()["added"] for _ in range(2)] == [2, 0]
    entries = log_of(world)
    assert len(entries) == 2
    # Corrected and deleted climbs do not come back either.
    change = ELSEWHERE | {"name": "Corrected", "kind": "top"}
    assert ask(world, "PUT", f"/me/log/others/{entries[0]['id']}", change).status_code == 204
    assert ask(world, "DELETE", f"/me/log/others/{entries[1]['id']}").status_code == 204
    assert ask(world, "POST", "/me/log/import", body).json()["added"] == 0
    assert [entry["name"] for entry in log_of(world)] == ["Corrected"]


@pytest.mark.parametrize("path", ["/me/log.csv", "/me/ascents.csv"])
def test_an_own_export_adds_nothing_here_and_all_elsewhere(
    world: World, route: str, path: str
) -> None:
    assert tick(world, uuid4(), route, kind="try").status_code == 201
    assert tick(world, uuid4(), route, note="=1+1;").status_code == 201
    if path == "/me/log.csv":
        assert put(world, uuid4()).status_code == 201
    table = ask(world, "GET", path).text
    count = len(log_of(world))
    body = {"text": table, "really": True}
    assert ask(world, "POST", "/me/log/import", body).json()["added"] == 0
    assert ask(world, "POST", "/me/log/import", body, who="judge").json()["added"] == count
    assert ask(world, "POST", "/me/log/import", body, who="judge").json()["added"] == 0
    copied = {(entry["day"], entry["name"], entry["kind"]) for entry in log_of(world, who="judge")}
    assert copied == {(entry["day"], entry["name"], entry["kind"]) for entry in log_of(world)}


@pytest.mark.parametrize(("time", "day"), [("03:59", "2026-03-13"), ("04:01", "2026-03-14")])
def test_an_imported_evening_past_midnight_is_one_day(world: World, time: str, day: str) -> None:
    text = f"climbed_at,gym_name,route_name,kind\n2026-03-14T{time}:00+00:00,Hall,Moon,top\n"
    (line,) = ask(world, "POST", "/me/log/import", {"text": text, "really": True}).json()["lines"]
    (entry,) = log_of(world)
    assert (line["day"], entry["day"]) == (day, day)
    assert ask(world, "POST", "/me/log/import", {"text": text, "really": True}).json()["added"] == 0


def test_a_year(world: World, route: str) -> None:
    for day, kind in (("2024-05-14", "onsight"), ("2024-05-21", "top"), ("2024-06-30", "try")):
        assert put(world, uuid4(), day=day, kind=kind).status_code == 201
    year = ask(world, "GET", "/me/log/years/2024").json()
    assert year["totals"] == {"ascents": 3, "tops": 2, "flashes": 1, "days": 3}
    assert (year["months"][4], sum(year["months"]), year["streak"]) == (2, 2, 2)
    assert year["grades"] == [{"label": "7b", "tops": 2}]
    assert ask(world, "GET", "/me/log/years/2019").json()["totals"]["ascents"] == 0


def test_own_data_has_it_and_deletion_removes_it(world: World) -> None:
    assert put(world, uuid4()).status_code == 201
    assert [row["name"] for row in ask(world, "GET", "/me/data").json()["other_ascents"]] == [
        "Kauk"
    ]


def test_somebody_without_a_gym_has_a_log(world: World) -> None:
    stranger: Somebody = world.server.person()
    answer = world.server.ask("PUT", f"/me/log/others/{uuid4()}", stranger, ELSEWHERE)
    assert answer.status_code == 201
    months = world.server.ask("GET", "/me/log", stranger).json()["months"]
    assert [month["month"] for month in months] == ["2024-05"]
