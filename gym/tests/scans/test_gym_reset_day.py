"""A reset day on a generated wall: routes of a table, a rescan of the left half, and ticks."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from gym.tests.worlds import World

from walltopo.scans.folder import ScanFolder, read_joined
from walltopo.scans.joined import Joined
from walltopo.scans.routes import Routes
from walltopo_gym.clock import now

pytestmark = pytest.mark.slow


@pytest.fixture
def joined(reset_day: Path) -> Joined:
    found = read_joined(ScanFolder(reset_day / "joined"))
    assert found is not None
    return found


def _ask(world: World, method: str, path: str, who: str, body: object = None) -> Any:
    answer = world.server.ask(method, path, world.people[who], body)
    assert answer.is_success, answer.text
    return answer.json() if answer.content else None


def _tick(world: World, route: str) -> None:
    tick = {"route_id": route, "kind": "top", "climbed_at": now().isoformat()}
    _ask(world, "PUT", f"{world.path}/ascents/{uuid4()}", "member", tick)


def _add_by_table(world: World, colours: dict[str, str]) -> dict[str, str]:
    """Add routes by CSV; return their ids by name."""
    path = f"{world.path}/walls/{world.wall.id}/routes"
    lines = [f"{name},{colour}" for name, colour in colours.items()]
    body = {"id": str(uuid4()), "csv": "\n".join(["name,colour", *lines]), "really": True}
    assert _ask(world, "POST", f"{path}/import", "setter", body)["added"] == len(colours)
    return {
        route["name"]: route["id"]
        for route in _ask(world, "GET", path, "member")
        if route["name"] in colours
    }


def test_ticks_live_on_through_a_reset_day(world: World, reset_day: Path, joined: Joined) -> None:
    before = Routes.load(ScanFolder(reset_day / "old").routes).routes
    after = Routes.load(ScanFolder(reset_day / "joined").routes).routes
    untouched = {route.id for route in before if set(route.holds) <= set(joined.stays)}
    assert untouched
    set_today = [route for route in after if set(route.holds) <= set(joined.added)]
    assert len(set_today) >= 2
    # The wall as it was: published, and climbed.
    whole = world.finished(reset_day / "old")
    entries = [{"number": route.id, "name": f"Old {route.id}"} for route in before]
    assert world.publish(whole, *entries).status_code == 200
    old = {route["number"]: route["id"] for route in world.published()["routes"]}
    for route in old.values():
        _tick(world, route)
    # The setters list two of their new routes before anybody photographs them.
    colours = {"Sun": set_today[0].colour, "Star": set_today[1].colour}
    added = _add_by_table(world, colours)
    for route in added.values():
        _tick(world, route)
    # Photos of the left half are scanned.
    part = world.finished(reset_day / "joined", part=True, reference_id=whole)
    path = f"{world.path}/scans/{part}"
    draft = _ask(world, "GET", f"{path}/draft", "setter")
    assert draft["warnings"] == []
    assert draft["joined"]["seam"]
    assert draft["joined"]["gone"] == len(joined.gone)
    assert {route["name"]: route["id"] for route in draft["unplaced"]} == added
    lines = {line["number"]: line for line in draft["lines"] if line["number"] is not None}
    for number in untouched:
        line = lines[number]
        assert (line["fate"], line["route_id"], line["photographed"]) == (
            "kept",
            old[number],
            False,
        )
    stripped = {line["route_id"] for line in draft["lines"] if line["fate"] == "stripped"}
    assert stripped
    assert not stripped & {old[number] for number in untouched}
    # The setter says which of the new routes are those of the table.
    same = {number: line["route_id"] for number, line in lines.items()}
    for name, route in zip(added, set_today, strict=False):
        assert lines[route.id]["fate"] == "new"
        assert lines[route.id]["photographed"]
        same[route.id] = added[name]
    body = [{"number": number, "route_id": route} for number, route in same.items()]
    answer = world.publish(part, *body, revision=draft["revision"])
    assert answer.status_code == 200, answer.text
    # Each route that is still there, or was listed before, has its tick and its place.
    shown = {route["id"]: route for route in world.published()["routes"]}
    assert not stripped & shown.keys()
    assert {shown[added[name]]["number"] for name in added} == {one.id for one in set_today[:2]}
    tallies = _ask(world, "GET", f"{world.path}/walls/{world.wall.id}/tallies", "member")
    climbers = {tally["route_id"]: tally["climbers"] for tally in tallies}
    ticked = {old[number] for number in untouched} | set(added.values())
    assert ticked <= shown.keys()
    assert all(climbers[route] == 1 for route in ticked)
    fresh = shown.keys() - set(old.values()) - set(added.values())
    assert not any(climbers.get(route) for route in fresh)
    # No tick is lost with a stripped route, and the wall as it was can still be seen.
    ascents = _ask(world, "GET", "/me/ascents?size=100", "member")["items"]
    assert {ascent["route_id"] for ascent in ascents} >= set(old.values()) | set(added.values())
    past = _ask(world, "GET", f"{world.path}/walls/{world.wall.id}/past/{whole}", "member")
    assert {route["id"] for route in past["routes"]} == set(old.values())
