"""Publications for later: at their time, with the whole zone, or not at all."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from uuid import UUID

import httpx
import pytest
from gym.tests.hurried import do_now, forget_jobs
from gym.tests.worlds import Server, World, hold
from sqlalchemy import update

from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Gym
from walltopo_gym.jobs.queue import Task
from walltopo_gym.publishing.models import Plan, Route
from walltopo_gym.publishing.plans import publish_due, record_failure
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.models import Wall
from walltopo_gym.walls.zones import PUBLICATIONS, queue_publications

HOLDS = [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4)]


def planned(world: World, scan: UUID, **words: Any) -> httpx.Response:
    entry = {"number": 1, "name": "Moon", "set_on": "2026-03-01", "grade_system_id": None}
    body = {"revision": 0, "routes": [entry], **words}
    return world.server.ask("PUT", f"{world.path}/scans/{scan}/plan", world.people["setter"], body)


def is_published(world: World, scan: UUID) -> bool:
    with world.server.database.reading() as session:
        return session.get_one(Scan, scan).state == "published"


def due(world: World) -> Task:
    """Return what carries out the gym's plans."""
    database = world.server.database
    return Task(PUBLICATIONS, lambda gym: publish_due(database, UUID(gym)), record_failure)


def past(world: World, scan: UUID) -> None:
    """The plan's time has come."""
    with world.server.database.writing() as session:
        plan = update(Plan).where(Plan.scan_id == scan)
        session.execute(plan.values(at=now() - timedelta(seconds=1)))
        queue_publications(session, world.gym.id)


@pytest.fixture(autouse=True)
def _no_jobs(server: Server) -> None:
    forget_jobs(server)


def test_it_is_published_at_its_time(world: World) -> None:
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    later = now() + timedelta(hours=1)
    assert planned(world, scan, at=later.isoformat()).status_code == 200
    (job,) = world.server.database.jobs.list_workflows(name=PUBLICATIONS.name)
    assert job.status == "DELAYED"
    assert job.delay_until_epoch_ms is not None
    assert abs(job.delay_until_epoch_ms / 1000 - later.timestamp()) < 60
    do_now(world.server, due(world))
    assert not is_published(world, scan)
    past(world, scan)
    do_now(world.server, due(world))
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
    do_now(world.server, due(world))
    assert not is_published(world, scan)
    second = world.reviewed({1: [1, 2]}, HOLDS)
    with world.server.database.writing() as session:
        session.get_one(Scan, second).wall_id = other.id
    assert planned(world, second).status_code == 200
    do_now(world.server, due(world))
    assert is_published(world, scan)
    assert is_published(world, second)


def test_a_zone_is_published_when_its_last_wall_goes(world: World) -> None:
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    ask, walls = world.server.ask, f"{world.path}/walls"
    assert ask("PATCH", f"{walls}/{world.wall.id}", world.owner, {"zone": "Cave"}).is_success
    other = ask("POST", walls, world.owner, {"name": "Roof", "zone": "Cave"}).json()["id"]
    assert planned(world, scan).status_code == 200
    do_now(world.server, due(world))
    assert not is_published(world, scan)
    assert ask("DELETE", f"{walls}/{other}", world.owner).is_success
    do_now(world.server, due(world))
    assert is_published(world, scan)


def test_a_plan_that_cannot_be_carried_out_says_why(world: World) -> None:
    scan, other = (world.reviewed({1: [1, 2]}, HOLDS) for _ in range(2))
    assert planned(world, scan, at=now().isoformat()).status_code == 200
    assert world.publish(other, {"number": 1}).is_success
    do_now(world.server, due(world))
    assert is_published(world, other)
    assert not is_published(world, scan)
    (plan,) = world.server.ask("GET", f"{world.path}/plans", world.owner).json()
    assert "another version" in plan["error"]
    path = f"{world.path}/scans/{scan}/plan"
    assert world.server.ask("DELETE", path, world.people["setter"]).status_code == 204


def test_a_scan_with_regressions_has_warnings(world: World) -> None:
    many = [hold(n, 0.3 * n, 1.0) for n in range(1, 11)]
    assert world.publish(world.reviewed({1: [1, 2]}, many)).is_success
    scan = world.reviewed({1: [1]}, many[:3])
    path = f"{world.path}/scans/{scan}/draft"
    draft = world.server.ask("GET", path, world.people["setter"]).json()
    assert draft["warnings"] == ["3 holds were found, 10 in the published version."]


def test_a_plan_names_routes_of_its_own_wall_alone(world: World) -> None:
    with world.server.database.writing() as session:
        gym = Gym(slug="elsewhere", name="Elsewhere", time_zone="UTC")
        session.add(gym)
        session.flush()
        wall = Wall(gym_id=gym.id, name="Slab")
        session.add(wall)
        session.flush()
        route = Route(wall_id=wall.id, set_on=now().date())
        session.add(route)
        session.flush()
        foreign = str(route.id)
    scan = world.reviewed({1: [1, 2]}, HOLDS)
    entry = {"number": 1, "route_id": foreign, "name": "Moon", "grade_system_id": None}
    later = (now() + timedelta(hours=1)).isoformat()
    answer = planned(world, scan, at=later, routes=[entry])
    assert (answer.status_code, answer.json()["code"]) == (422, "entry-not-current")
    assert world.server.ask("GET", f"{world.path}/plans", world.owner).json() == []
