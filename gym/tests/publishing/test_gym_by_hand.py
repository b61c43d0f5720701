"""Routes without a scan: added by hand or from a table, climbed, and placed by a later scan."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import pytest
from gym.tests.worlds import Somebody, World, hold
from tests.at_once import at_once

from walltopo_gym.clock import now
from walltopo_gym.languages import LANGUAGES
from walltopo_gym.publishing.colours import colour_of
from walltopo_gym.words import words_in

HOLDS = [hold(n, 0.5 * n, 1.0 + 0.1 * (n % 3)) for n in range(1, 9)]
TABLE = """name;grade;colour;setter;tags;set_on;strip_on
Moon;6A;rouge;Jana;slab, jump;2026-03-01;24. 12. 2026
;6B;Červená;;;;
"""


def ask(
    world: World,
    method: str,
    path: str,
    body: object = None,
    who: str = "setter",
    status: int = 200,
) -> Any:
    answer = world.server.ask(method, world.path + path, world.people[who], body)
    assert answer.status_code == status, answer.text
    return answer.json() if answer.content else None


def add(world: World, *routes: dict[str, Any], status: int = 201) -> Any:
    path = f"/walls/{world.wall.id}/routes"
    return ask(world, "POST", path, {"routes": list(routes)}, status=status)


def read_in(world: World, csv: str, **how: Any) -> Any:
    body = {"id": str(uuid4()), "csv": csv} | how
    return ask(world, "POST", f"/walls/{world.wall.id}/routes/import", body)


def listed(world: World, who: str = "member") -> Any:
    return ask(world, "GET", f"/walls/{world.wall.id}/routes", who=who)


def tick(world: World, route: str, who: str = "member") -> None:
    climbed = {"route_id": route, "kind": "top", "climbed_at": now().isoformat()}
    answer = world.server.ask("PUT", f"{world.path}/ascents/{uuid4()}", world.people[who], climbed)
    assert answer.is_success, answer.text


def font(world: World) -> str:
    systems = ask(world, "GET", "/grade-systems")
    return str(systems[0]["id"])


def test_a_wall_without_a_scan_has_routes(world: World) -> None:
    facts = {"name": "Moon", "colour": "red", "grade_system_id": font(world), "grade": "6A"}
    (route,) = add(world, facts | {"setter": "Jana", "tags": ["slab"], "strip_on": "2199-01-01"})
    assert route["by_hand"]
    assert route["number"] is None
    assert listed(world) == [route]
    assert ask(world, "GET", "/routes", who="member") == [route]
    tick(world, route["id"])
    ask(world, "PUT", f"/routes/{route['id']}/opinion", {"stars": 4}, "member", 204)
    (tally,) = ask(world, "GET", f"/walls/{world.wall.id}/tallies", who="member")
    assert (tally["route_id"], tally["climbers"], tally["stars"]) == (route["id"], 1, 4)
    (figures,) = ask(world, "GET", "/insights")["routes"]
    assert (figures["id"], figures["number"], figures["ascents"]) == (route["id"], None, 1)
    board = ask(world, "GET", "/board", who="member")
    assert board is not None
    # A setter corrects it as any other route, and its colour too.
    changed = ask(world, "PATCH", f"/routes/{route['id']}", {"name": "Sun", "colour": "blue"})
    assert (changed["name"], changed["colour"], changed["grade"]) == ("Sun", "blue", "6A")
    card = world.server.ask("GET", f"{world.path}/cards.pdf", world.people["setter"])
    assert card.content.startswith(b"%PDF")


def test_a_repeated_request_adds_nothing(world: World) -> None:
    given = [{"id": str(uuid4()), "name": name} for name in ("Moon", "Sun")]
    first = add(world, *given)
    revision = ask(world, "GET", f"/walls/{world.wall.id}")["revision"]
    assert add(world, *given) == first
    assert ask(world, "GET", f"/walls/{world.wall.id}")["revision"] == revision
    other = ask(world, "POST", "/walls", {"name": "Other"}, status=201)["id"]
    taken = {"routes": given[:1]}
    refused = ask(world, "POST", f"/walls/{other}/routes", taken, status=409)
    assert refused["code"] == "id-taken"
    assert add(world, given[0], given[0], status=422)["code"] == "route-twice"
    table = str(uuid4())
    for _ in range(2):
        assert read_in(world, "name\nStar\nComet", id=table, really=True)["added"] == 2
    assert {route["name"] for route in listed(world)} == {"Moon", "Sun", "Comet", "Star"}
    assert len(listed(world)) == 4


def test_of_two_copies_at_once_one_adds(world: World) -> None:
    given = {"id": str(uuid4()), "name": "Moon"}

    def send() -> int:
        path = f"{world.path}/walls/{world.wall.id}/routes"
        answer = world.server.ask("POST", path, world.people["setter"], {"routes": [given]})
        return answer.status_code

    statuses = at_once(*3 * [send])
    assert statuses == [201] * 3
    assert len(listed(world)) == 1


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"setter": "Jana"}, "route-no-name"),
        ({"name": "Moon", "grade": "6A"}, "grade-needs-system"),
        ({"name": "M", "set_on": "2026-03-02", "strip_on": "2026-03-01"}, "strip-before-set"),
    ],
)
def test_one_wrong_route_adds_none(world: World, wrong: dict[str, Any], code: str) -> None:
    assert add(world, wrong, status=422)["code"] == code
    refused = add(world, {"name": "Right"}, wrong, status=422)
    assert refused["code"] == "route-of-many"
    assert refused["values"]["number"] == "2"
    assert listed(world) == []


def test_a_table_is_shown_before_it_is_stored(world: World) -> None:
    shown = read_in(world, TABLE)
    assert shown["errors"] == []
    assert shown["added"] == 0
    assert listed(world) == []
    first, second = shown["routes"]
    assert (first["line"], first["colour"], first["strip_on"]) == (2, "red", "2026-12-24")
    assert first["tags"] == ["slab", "jump"]
    assert (second["line"], second["name"], second["colour"]) == (3, "", "red")
    assert not second["known"]
    assert read_in(world, TABLE, really=True)["added"] == 2
    assert {route["grade"] for route in listed(world)} == {"6A", "6B"}
    assert [line["known"] for line in read_in(world, TABLE)["routes"]] == [True, True]


@pytest.mark.parametrize("between", [",", ";", "\t"])
def test_the_separators_of_spreadsheets(world: World, between: str) -> None:
    rows = [["name", "grade", "colour"], ["Moon", "6a", "gray"]]
    text = "\ufeff" + "\r\n".join(between.join(row) for row in rows)
    (line,) = read_in(world, text)["routes"]
    assert (line["name"], line["grade"], line["colour"]) == ("Moon", "6A", "grey")


@pytest.mark.parametrize(
    ("days", "read"),
    [
        (("03/05/2026", "24/12/2026"), ("2026-05-03", "2026-12-24")),
        (("03/05/2026", "12/24/2026"), ("2026-03-05", "2026-12-24")),
        (("3.5.2026", "2026-12-24"), ("2026-05-03", "2026-12-24")),
    ],
)
def test_the_dates_of_spreadsheets(
    world: World, days: tuple[str, str], read: tuple[str, str]
) -> None:
    (line,) = read_in(world, "name,set_on,strip_on\nMoon," + ",".join(days))["routes"]
    assert (line["set_on"], line["strip_on"]) == read


def test_errors_name_line_and_column(world: World) -> None:
    table = (
        "name,grade,colour,tags,set_on,strip_on,grade_system\n"
        "Right,6A,red,,,,\n"
        "\n"
        "Bad grade,99,red,,,,\n"
        "Bad day,,,,11/12/2026,2026-02-30,\n"
        ",,,x,,,\n"
        f"{'x' * 81},,,,,,\n"
        "Bad order,,,,2026-03-02,2026-03-01,\n"
        "Bad system,6A,,,,,Norwegian\n"
    )
    read = read_in(world, table, really=True)
    assert [(one["line"], one["column"], one["code"]) for one in read["errors"]] == [
        (4, "grade", "cell-no-grade"),
        (5, "set_on", "cell-no-day"),
        (5, "strip_on", "cell-no-day"),
        (6, "name", "route-no-name"),
        (7, "name", "cell-too-long"),
        (8, "strip_on", "strip-before-set"),
        (9, "grade_system", "cell-no-system"),
    ]
    assert [line["name"] for line in read["routes"]] == ["Right"]
    assert read["added"] == 0
    assert listed(world) == []
    # The setter confirms that the right ones are added.
    assert read_in(world, table, really=True, without_wrong=True)["added"] == 1
    assert [route["name"] for route in listed(world)] == ["Right"]
    path = f"/walls/{world.wall.id}/routes/import"
    for text, code in (
        ("nom\nMoon", "table-unknown"),
        ("", "table-none"),
        ("grade\n6A", "table-no-name"),
    ):
        refused = ask(world, "POST", path, {"id": str(uuid4()), "csv": text}, status=422)
        assert refused["code"] == code


def test_a_grade_of_two_systems_needs_its_system(world: World) -> None:
    own = {"name": "Circuit", "kind": "own", "grades": [{"label": "6A"}, {"label": "Blue"}]}
    made = ask(world, "POST", "/grade-systems", own, "owner", 201)
    (error,) = read_in(world, "name,grade\nMoon,6A")["errors"]
    assert error["code"] == "cell-grade-twice"
    table = "name,grade,grade_system\nMoon,6A,circuit\nSun,blue,"
    assert read_in(world, table, really=True)["added"] == 2
    assert {route["grade_system_id"] for route in listed(world)} == {made["id"]}
    assert {route["grade"] for route in listed(world)} == {"6A", "Blue"}


def test_colours_are_known_in_each_language() -> None:
    for language in LANGUAGES:
        for colour, name in words_in(language).colours.items():
            assert colour_of(name) == colour
            assert colour_of(name.upper()) == colour
    assert colour_of("Neon") == "Neon"


def test_a_scan_places_what_the_setter_names(world: World) -> None:
    named, other = add(world, {"name": "Moon", "colour": "red"}, {"name": "Sun"})
    tick(world, named["id"])
    scan = world.reviewed({1: [1, 2, 3], 2: [4, 5, 6]}, HOLDS)
    draft = ask(world, "GET", f"/scans/{scan}/draft")
    assert [route["id"] for route in draft["unplaced"]] == [named["id"], other["id"]]
    assert {line["fate"] for line in draft["lines"]} == {"new"}
    entries = [{"number": 1, "route_id": named["id"]}, {"number": 2, "name": "New"}]
    assert world.publish(scan, *entries, revision=draft["revision"]).status_code == 200
    routes = {route["name"]: route for route in world.published()["routes"]}
    assert list(routes) == ["Moon", "New", "Sun"]
    assert (routes["Moon"]["id"], routes["Moon"]["holds"]) == (named["id"], [1, 2, 3])
    assert routes["Sun"]["number"] is None
    assert routes["Sun"]["stripped_at"] is None
    history = ask(world, "GET", f"/routes/{named['id']}/history", who="member")
    assert history["tally"]["climbers"] == 1
    assert len(history["versions"]) == 1
    # From now on it is a route like any other: the next scan strips it unless it is named.
    empty = world.reviewed({}, [])
    assert world.publish(empty, revision=world.published()["revision"]).status_code == 200
    assert [route["name"] for route in world.published()["routes"]] == ["Sun"]


def test_a_rollback_keeps_what_was_added_by_hand(world: World) -> None:
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    assert world.publish(scan, {"number": 1, "name": "Old"}).status_code == 200
    (added,) = add(world, {"name": "Moon"})
    later = world.reviewed({1: [3, 4]}, HOLDS)
    placed = {"number": 1, "route_id": added["id"]}
    assert world.publish(later, placed, revision=2).status_code == 200
    body = {"scan_id": str(scan), "revision": 3}
    ask(world, "POST", f"/walls/{world.wall.id}/put-back", body)
    routes = {route["name"]: route["number"] for route in world.published()["routes"]}
    assert routes == {"Old": 1, "Moon": None}


def test_stripping_can_be_undone(world: World) -> None:
    (route,) = add(world, {"name": "Moon"})
    path = f"/routes/{route['id']}"
    assert ask(world, "POST", f"{path}/restore", status=409)["code"] == "route-current"
    assert ask(world, "POST", f"{path}/strip")["stripped_at"] is not None
    assert listed(world) == []
    assert ask(world, "POST", f"{path}/restore") == route
    assert listed(world) == [route]
    # A route that only a former version shows comes back with that version.
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    assert world.publish(scan, {"number": 1, "name": "Old"}, revision=3).status_code == 200
    old = world.published()["routes"][0]["id"]
    ask(world, "POST", f"/routes/{old}/strip")
    assert ask(world, "POST", f"/routes/{old}/restore")["number"] == 1
    assert world.publish(world.reviewed({}, []), revision=6).status_code == 200
    refused = ask(world, "POST", f"/routes/{old}/restore", status=409)
    assert refused["code"] == "route-in-former-version"


def test_only_an_unused_route_is_deleted(world: World) -> None:
    unused, ticked, rated = add(world, {"name": "A"}, {"name": "B"}, {"name": "C"})
    tick(world, ticked["id"])
    ask(world, "PUT", f"/routes/{rated['id']}/opinion", {"stars": 4}, "member", 204)
    for route in (ticked, rated):
        refused = ask(world, "DELETE", f"/routes/{route['id']}", status=409)
        assert refused["code"] == "route-in-use"
    ask(world, "DELETE", f"/routes/{unused['id']}", status=204)
    assert [route["name"] for route in listed(world)] == ["B", "C"]
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    revision = ask(world, "GET", f"/walls/{world.wall.id}")["revision"]
    assert world.publish(scan, {"number": 1}, revision=revision).status_code == 200
    placed = world.published()["routes"][0]["id"]
    refused = ask(world, "DELETE", f"/routes/{placed}", status=409)
    assert refused["code"] == "route-of-scan"


def test_the_log_and_other_gyms(world: World) -> None:
    (route,) = add(world, {"name": "Moon"})
    ask(world, "DELETE", f"/routes/{route['id']}", status=204)
    actions = [entry["action"] for entry in ask(world, "GET", "/audit", who="owner")["items"]]
    assert actions[:2] == ["route.delete", "route.add"]
    stranger: Somebody = world.server.person()
    path = f"{world.path}/walls/{world.wall.id}/routes"
    refused = world.server.ask("POST", path, stranger, {"routes": [{"name": "Moon"}]})
    assert refused.status_code in (403, 404)
