"""The demo's climbers are made up once, the same each time; its routes are graded and named."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any

from gym.tests.worlds import World, hold, make_world
from sqlalchemy import func, select

from walltopo.scans.routes import Route as FoundRoute
from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.competitions.history import board_of
from walltopo_gym.competitions.models import Competition
from walltopo_gym.demo.crowd import ASCENTS, CLIMBERS, fill
from walltopo_gym.demo.cups import COMPETITORS, hold_cups
from walltopo_gym.demo.hall import name_routes
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.publishing.models import Route

HOLDS = [hold(n, 0.4 * n, 1.0) for n in range(1, 7)]


def filled(world: World) -> list[tuple[Any, ...]]:
    """The ascents of a hall of two routes, after it was filled twice."""
    scan = world.reviewed({1: [1, 2, 3], 2: [4, 5, 6]}, HOLDS)
    assert world.publish(scan, {"number": 1}, {"number": 2}).is_success
    with world.server.database.writing() as session:
        hanging = select(Route).where(Route.wall_id == world.wall.id)
        routes = sorted(session.scalars(hanging), key=lambda route: str(route.name))
        for route, grade in zip(routes, ("5+", "6C"), strict=True):
            route.grade = grade
        gym = session.get_one(Gym, world.gym.id)
        moment = datetime(2026, 3, 1, 12, tzinfo=UTC)
        for _ in range(2):
            fill(session, gym, sorted(routes, key=lambda route: route.grade), moment)
        rows = select(Ascent).where(Ascent.gym_id == gym.id).order_by(Ascent.climbed_at, Ascent.id)
        ascents = session.scalars(rows).all()
        assert all(moment - timedelta(days=43) < row.climbed_at <= moment for row in ascents)
        return [(row.kind, row.tries, row.grade, row.climbed_at - moment) for row in ascents]


def test_forty_climbers_six_hundred_ascents_the_same_each_time(world: World) -> None:
    first = filled(world)
    assert len(first) == ASCENTS
    with world.server.database.writing() as session:
        count = select(func.count()).where(Membership.gym_id == world.gym.id)
        assert session.scalar(count) == CLIMBERS + 4
        made_up = select(Person).where(Person.name.endswith("(made up)"))
        for person in session.scalars(made_up):  # nobody signs in as one of them
            assert not world.server.passwords.matches(person.password_hash, "!")
            session.delete(person)
    assert sorted(first) == sorted(filled(make_world(world.server)))
    assert {kind for kind, *_ in first} >= {"flash", "top", "try"}
    assert all(tries == 1 for kind, tries, *_ in first if kind == "flash")


def test_two_festivals_one_of_them_runs(world: World) -> None:
    scan = world.reviewed({1: [1, 2, 3], 2: [4, 5, 6]}, HOLDS)
    assert world.publish(scan, {"number": 1}, {"number": 2}).is_success
    owner = world.owner.id
    assert owner is not None
    with world.server.database.writing() as session:
        gym = session.get_one(Gym, world.gym.id)
        session.add_all(
            Person(email=f"climber{n}@{gym.slug}.invalid", name=f"Climber {n}", password_hash="!")
            for n in range(COMPETITORS)
        )
        session.flush()
        routes = session.scalars(select(Route).where(Route.wall_id == world.wall.id)).all()
        for _ in range(2):
            hold_cups(session, gym, owner, routes, now())
        cups = session.scalars(select(Competition).where(Competition.gym_id == gym.id)).all()
        assert sorted(cup.state for cup in cups) == ["ended", "running"]
        for cup in cups:
            lines = [line for of in board_of(session, cup).lines().values() for line in of]
            assert len(lines) == COMPETITORS
            assert {line.rank for line in lines} >= {1, 2}
        # Another day: the same two, and one that runs.
        later = now() + timedelta(days=2)
        hold_cups(session, gym, owner, routes, later)
        again = session.scalars(select(Competition).where(Competition.gym_id == gym.id)).all()
        assert [cup.id for cup in again] == [cup.id for cup in cups]
        assert [cup.ends_at is not None and cup.ends_at > later for cup in again] == [
            cup.state == "running" for cup in again
        ]


def test_every_route_is_named_and_the_harder_looking_graded_harder() -> None:
    found = {n: FoundRoute(id=n, colour="red", steepness_deg=50.0 - 9 * n) for n in range(1, 5)}
    named = name_routes(found)
    assert len({str(facts["name"]) for facts in named.values()}) == 4
    assert [named[n]["grade"] for n in (4, 3, 2, 1)] == ["5", "6A", "6B", "6C"]
