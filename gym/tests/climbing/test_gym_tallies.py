"""Tallies of a route: for everybody, for voters, and for the climber."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import pytest
from gym.tests.worlds import World, hold

from walltopo_gym.climbing.points import crowd_grade
from walltopo_gym.clock import now

pytestmark = pytest.mark.both_databases("aggregates in SQL")

LABELS = ("5", "6A", "6B", "6C")


@pytest.mark.parametrize(
    ("votes", "crowd"),
    [
        ({"6A": 2}, ""),
        ({"6A": 2, "9Z": 5}, ""),  # a label that the system has no more
        ({"6A": 2, "6C": 1}, "6A"),
        ({"6A": 2, "6C": 2}, "6A"),
        ({"5": 1, "6B": 3, "6C": 9}, "6C"),
    ],
)
def test_the_crowds_grade_is_the_median_of_enough_votes(votes: dict[str, int], crowd: str) -> None:
    assert crowd_grade(votes, LABELS) == crowd


@pytest.fixture
def route(world: World) -> str:
    """A graded route that hangs."""
    system = world.server.ask(
        "POST",
        f"{world.path}/grade-systems",
        world.owner,
        {"name": "Ours", "kind": "font", "grades": [{"label": label} for label in LABELS]},
    )
    scan = world.reviewed({1: [1, 2]}, [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4)])
    entry = {"number": 1, "name": "Moon", "grade": "6A", "grade_system_id": system.json()["id"]}
    assert world.publish(scan, entry).is_success
    found: str = world.published()["routes"][0]["id"]
    return found


def ask(world: World, who: str, path: str) -> Any:
    answer = world.server.ask("GET", world.path + path, world.people[who])
    assert answer.is_success, answer.text
    return answer.json()


def test_who_has_not_voted_sees_no_votes(world: World, route: str) -> None:
    for who, grade in (("judge", "6B"), ("setter", "6B"), ("owner", "6A")):
        path = f"{world.path}/routes/{route}/opinion"
        assert world.server.ask("PUT", path, world.people[who], {"grade": grade}).is_success
    spread = {"6A": 1, "6B": 2}
    for path in (f"/routes/{route}/history", "/tallies", f"/walls/{world.wall.id}/tallies"):
        seen = {who: ask(world, who, path) for who in ("member", "judge", "owner")}
        for who, row in seen.items():
            seen[who] = row[0] if isinstance(row, list) else row["tally"]
        assert {who: row["grades"] for who, row in seen.items()} == {
            "member": {},
            "judge": spread,
            "owner": spread,
        }
        assert {(row["crowd"], row["votes"]) for row in seen.values()} == {("6B", 3)}


def test_a_story_goes_back_over_resets(world: World, route: str) -> None:
    scan = world.reviewed({4: [7, 8]}, [hold(7, 0.0, 1.0), hold(8, 0.3, 1.4)])
    published = world.publish(scan, {"number": 4, "route_id": route}, revision=1)
    assert published.is_success, published.text
    versions = ask(world, "member", f"/routes/{route}/history")["versions"]
    assert [(row["number"], row["holds"]) for row in versions] == [(4, [7, 8]), (1, [1, 2])]
    current = ask(world, "member", "/routes")
    assert [(row["id"], row["number"]) for row in current] == [(route, 4)]


def test_a_logbook_has_notes_and_what_hangs_alone(world: World, route: str) -> None:
    path = f"{world.path}/ascents/{uuid4()}"
    body = {
        "route_id": route,
        "kind": "project",
        "note": "left foot\nhigh",
        "climbed_at": now().isoformat(),
    }
    assert world.server.ask("PUT", path, world.people["member"], body).is_success
    opinion_body = {"stars": 4, "wish": "keep"}
    opinion = f"{world.path}/routes/{route}/opinion"
    assert world.server.ask("PUT", opinion, world.people["member"], opinion_body).is_success
    kept = ask(world, "member", "/logbook")
    assert [row["note"] for row in kept["ascents"]] == ["left foot\nhigh"]
    assert [(row["route_id"], row["stars"]) for row in kept["opinions"]] == [(route, 4)]
    assert ask(world, "judge", "/logbook") == {"ascents": [], "opinions": []}
    strip = f"{world.path}/routes/{route}/strip"
    assert world.server.ask("POST", strip, world.people["setter"]).is_success
    assert ask(world, "member", "/logbook")["ascents"] == []
