"""Publications for later: at their time, with the whole zone, or not at all."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from uuid import UUID

import httpx
from gym.tests.worlds import World, hold
from sqlalchemy import update

from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Wall
from walltopo_gym.publishing.models import Plan
from walltopo_gym.publishing.plans import publish_due
from walltopo_gym.scans.models import Scan

HOLDS = [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4)]


def planned(world: World, scan: UUID, **words: Any) -> httpx.Response:
    entry = {"number": 1, "name": "Moon", "set_on": "2026-03-01", "grade_system_id": None}
    body = {"revision": 0, "routes": [entry], **words}
    return world.server.ask("PUT", f"{world.path}/scans/{scan}/plan", world.people["setter"], body)


def is_published(world: World, scan: UUID) -> bool:
    with world.server.database.reading() as session:
        return session.get_one(Scan, scan).state == "published"


def past(world: World, scan: UUID) -> None:
    """The plan's time has come."""
    with world.server.database.writing() as session:
        due = update(Plan).where(Plan.scan_id == scan)
        session.execute(due.values(at=now() - timedelta(seconds=1)))


def test_it_is_published_at_its_time(world: World) -> None:
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    later = (now() + timedelta(hours=1)).isoformat()
    assert planned(world, scan, at=later).status_code == 200
    publish_due(world.server.database)
    assert not is_published(world, scan)
    past(world, scan)
    publish_due(world.server.database)
    assert is_published(world, scan)
    (route,) = world.published()["routes"]
    assert (route["name"], route["set_on"], route["holds"]) == ("Moon", "2026-03-01", [1, 2])
    plans = world.server.ask("GET", f"{world.path}/plans", world.owner).json()
    assert plans == []


def test_a_zone_is_published_when_all_of_it_is_there(world: World) -> None:
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    assert planned(world, scan).status_code == 409  # in no zone
    with world.server.database.writing() as session:
        session.get_one(Wall, world.wall.id).zone = "Cave"
        other = Wall(gym_id=world.gym.id, name="Roof", zone="Cave")
        session.add(other)
    assert planned(world, scan).status_code == 200
    publish_due(world.server.database)
    assert not is_published(world, scan)
    second = world.reviewed({1: [1, 2]}, HOLDS)
    with world.server.database.writing() as session:
        session.get_one(Scan, second).wall_id = other.id
    assert planned(world, second).status_code == 200
    publish_due(world.server.database)
    assert is_published(world, scan)
    assert is_published(world, second)


def test_a_plan_that_cannot_be_carried_out_says_why(world: World) -> None:
    scan, other = (world.reviewed({1: [1, 2]}, HOLDS) for _ in range(2))
    assert planned(world, scan, at=now().isoformat()).status_code == 200
    assert world.publish(other, {"number": 1}).is_success
    publish_due(world.server.database)
    assert is_published(world, other)
    assert not is_published(world, scan)
    (plan,) = world.server.ask("GET", f"{world.path}/plans", world.owner).json()
    assert "another version" in plan["error"]
    path = f"{world.path}/scans/{scan}/plan"
    assert world.server.ask("DELETE", path, world.people["setter"]).status_code == 204


def test_a_scan_that_looks_worse_is_said_to_be(world: World) -> None:
    many = [hold(n, 0.3 * n, 1.0) for n in range(1, 11)]
    assert world.publish(world.reviewed({1: [1, 2]}, many)).is_success
    scan = world.reviewed({1: [1]}, many[:3])
    path = f"{world.path}/scans/{scan}/draft"
    told = world.server.ask("GET", path, world.people["setter"]).json()
    assert told["warnings"] == ["3 holds were found, 10 in the published version."]
