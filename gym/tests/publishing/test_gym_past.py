"""Every version that was published can be looked at, with its routes as they were."""

from __future__ import annotations

from typing import Any

from gym.tests.worlds import NOBODY, World, hold

HOLDS = [hold(1, 0.0, 1.0), hold(2, 2.0, 1.0)]


def past(world: World, rest: str = "") -> Any:
    path = f"{world.path}/walls/{world.wall.id}/past{rest}"
    answer = world.server.ask("GET", path, world.people["member"])
    return answer.json() if answer.is_success else answer.status_code


def test_a_former_version_keeps_its_route_facts(world: World) -> None:
    first = world.reviewed({1: [1], 2: [2]}, HOLDS)
    entries = [{"number": 1, "name": "Moon", "setter": "Jana"}, {"number": 2, "name": "Sun"}]
    assert world.publish(first, *entries).is_success
    moon = next(row for row in world.published()["routes"] if row["name"] == "Moon")
    second = world.reviewed({1: [1]}, HOLDS)
    entry = {"number": 1, "route_id": moon["id"], "name": "Full Moon"}
    assert world.publish(second, entry, revision=1).is_success
    listed = past(world)
    assert [(row["scan_id"], row["present"]) for row in listed] == [
        (str(first), False),
        (str(second), True),
    ]
    was = past(world, f"/{first}")
    assert [(row["name"], row["number"], row["holds"]) for row in was["routes"]] == [
        ("Moon", 1, [1]),
        ("Sun", 2, [2]),
    ]
    assert list(was["files"]) == ["index.html"]
    assert [row["name"] for row in past(world, f"/{second}")["routes"]] == ["Full Moon"]
    sun = was["routes"][1]["id"]
    assert [row["scan_id"] for row in past(world, f"?route={sun}")] == [str(first)]


def test_what_was_never_published_is_not_there(world: World) -> None:
    draft = world.reviewed({1: [1]}, HOLDS)
    assert past(world) == []
    assert past(world, f"/{draft}") == 404


def test_a_gym_gone_private_shows_its_past_to_members_alone(world: World) -> None:
    server = world.server
    assert server.ask("PATCH", world.path, world.owner, {"visibility": "public"}).is_success
    scan = world.reviewed({1: [1]}, HOLDS)
    assert world.publish(scan, {"number": 1}).is_success
    path = f"{world.path}/walls/{world.wall.id}/past/{scan}"
    assert server.ask("GET", path, NOBODY).is_success
    assert server.ask("PATCH", world.path, world.owner, {"visibility": "private"}).is_success
    assert server.ask("GET", path, NOBODY).status_code == 404
