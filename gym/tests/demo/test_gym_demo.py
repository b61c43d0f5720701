"""The demo's climbers are made up once, the same each time, and climb as people do."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import numpy as np
from gym.tests.worlds import World, hold, make_world
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo.scans.routes import Route as FoundRoute
from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.counting import recount_gym
from walltopo_gym.climbing.kinds import FIRST_TRIES, Kind, kinds_of
from walltopo_gym.climbing.models import Ascent, ClimbingSession, Opinion, Standing
from walltopo_gym.clips.models import Clip
from walltopo_gym.clock import now
from walltopo_gym.competitions.demo import COMPETITORS, hold_cups
from walltopo_gym.competitions.history import board_of
from walltopo_gym.competitions.models import Competition
from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.crowd.people import CLIMBERS, DAYS, add_climbers, email_of
from walltopo_gym.demo.clip import DemoClip, send_clip
from walltopo_gym.demo.hall import NAME, name_routes
from walltopo_gym.demo.ropes import make_ropes
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.lists.demo import make_lists
from walltopo_gym.lists.models import ClimbList
from walltopo_gym.lists.service import group_progress
from walltopo_gym.problems.demo import make_problems
from walltopo_gym.problems.models import Problem, ProblemAscent, ProblemHold
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.version_holds import version_holds
from walltopo_gym.walls.disciplines import Discipline
from walltopo_gym.walls.models import Wall

UNTIL = datetime(2026, 3, 1, 12, tzinfo=UTC)
GRADES = ("4", "5", "5+", "6A", "6A+", "6B", "6B+", "6C", "6C+", "7A")
HOLDS = [hold(n, 0.4 * n, 1.0) for n in range(1, 3 * len(GRADES) + 1)]


def graded(world: World, session: Session) -> list[Route]:
    """A wall's ten routes by their grades, half of them set four weeks ago."""
    current = select(Route).where(Route.wall_id == world.wall.id)
    routes = sorted(session.scalars(current), key=lambda route: route.name)
    for place, (route, grade) in enumerate(zip(routes, GRADES, strict=True)):
        route.grade = grade
        route.set_on = (UNTIL - timedelta(days=28 if place % 2 else DAYS + 1)).date()
    return routes


def published(world: World) -> World:
    numbers = range(1, len(GRADES) + 1)
    scan = world.reviewed({n: [3 * n - 2, 3 * n - 1, 3 * n] for n in numbers}, HOLDS)
    entries = ({"number": n, "name": f"{n:02}"} for n in numbers)
    assert world.publish(scan, *entries).is_success
    return world


def filled(world: World, session: Session) -> tuple[list[Route], list[Ascent]]:
    """The routes and the ascents of a hall that was filled twice."""
    routes = graded(world, session)
    gym = session.get_one(Gym, world.gym.id)
    for _ in range(2):
        add_climbers(session, gym, routes, UNTIL)
    rows = select(Ascent).where(Ascent.gym_id == gym.id).order_by(Ascent.climbed_at, Ascent.id)
    return routes, list(session.scalars(rows))


def lines(ascents: list[Ascent]) -> list[tuple[Any, ...]]:
    return sorted((row.kind, row.tries, row.grade, row.climbed_at) for row in ascents)


def test_the_climbers_are_the_same_each_time_and_nobody_signs_in_as_one(world: World) -> None:
    answer = []
    for each in (published(world), published(make_world(world.server))):
        with world.server.database.writing() as session:
            _, ascents = filled(each, session)
            answer.append(lines(ascents))
            count = select(func.count()).where(Membership.gym_id == each.gym.id)
            assert session.scalar(count) == CLIMBERS + 4
            gym = session.get_one(Gym, each.gym.id)
            emails = [email_of(gym, number) for number in range(CLIMBERS)]
            people = session.scalars(select(Person).where(Person.email.in_(emails))).all()
            assert len({person.name for person in people}) == CLIMBERS
        for person in people:
            assert not world.server.passwords.matches(person.password_hash, "!")
    assert answer[0] == answer[1]
    assert len(answer[0]) > 300


def test_their_logs_are_plausible(world: World) -> None:
    published(world)
    with world.server.database.writing() as session:
        routes, ascents = filled(world, session)
        by_id = {route.id: route for route in routes}
        begun = UNTIL - timedelta(days=DAYS)
        tops: Counter[tuple[UUID, UUID]] = Counter()
        seen: set[tuple[UUID, UUID]] = set()
        for row in ascents:
            assert row.route_id is not None
            assert begun.date() <= row.climbed_at.date() < UNTIL.date()
            assert by_id[row.route_id].set_on <= row.climbed_at.date()
            key = row.person_id, row.route_id
            if row.kind == "flash":
                assert row.tries == 1
                assert key not in seen
            tops[key] += row.kind in ("flash", "top")
            seen.add(key)
        assert max(tops.values()) == 2, "a top, and at most one more on a later visit"
        kinds = Counter(row.kind for row in ascents)
        assert kinds.keys() == {"flash", "top", "zone", "try", "project"}
        assert kinds["flash"] < sum(kinds.values()) / 2
        # The harder, the fewer: of the two easiest several times as many as of the two hardest.
        topped = Counter(by_id[route].grade for (_, route), count in tops.items() if count)
        assert topped["4"] + topped["5"] > 3 * (topped["6C+"] + topped["7A"]) > 0

    recount_gym(world.server.database, world.gym.id)
    with world.server.database.reading() as session:
        visits = select(ClimbingSession).where(ClimbingSession.gym_id == world.gym.id)
        assert all(visit.tries <= 30 for visit in session.scalars(visits))
        points = session.scalars(
            select(Standing.points).where(Standing.gym_id == world.gym.id, Standing.period == "all")
        ).all()
        assert len(set(points)) > 0.6 * len(points), "ranks differ"


def test_their_opinions_are_of_what_they_topped(world: World) -> None:
    published(world)
    with world.server.database.writing() as session:
        routes, ascents = filled(world, session)
        topped = {(r.person_id, r.route_id) for r in ascents if r.kind in ("flash", "top")}
        of = select(Opinion).where(Opinion.route_id.in_([route.id for route in routes]))
        opinions = session.scalars(of).all()
        assert len(opinions) > 50
        assert {(row.person_id, row.route_id) for row in opinions} <= topped
        grade = {route.id: FONT.index(route.grade) for route in routes}
        assert all(abs(FONT.index(row.grade) - grade[row.route_id]) <= 2 for row in opinions)
        words = [(row.route_id, row.comment) for row in opinions if row.comment]
        assert 0 < len(words) < 0.2 * len(opinions)
        assert len(words) == len(set(words)), "nobody repeats another"


def with_cups(world: World, session: Session) -> tuple[Gym, UUID, list[Route]]:
    """Return the gym with climbers and festivals, its owner and its routes."""
    owner = world.owner.id
    assert owner is not None
    gym = session.get_one(Gym, world.gym.id)
    routes, _ = filled(world, session)
    hold_cups(session, DemoFilled(gym, owner, routes, (), {}, now()))
    return gym, owner, routes


def test_two_festivals_one_of_them_runs(world: World) -> None:
    published(world)
    with world.server.database.writing() as session:
        gym, owner, routes = with_cups(world, session)
        hold_cups(session, DemoFilled(gym, owner, routes, (), {}, now()))
        cups = session.scalars(select(Competition).where(Competition.gym_id == gym.id)).all()
        assert sorted(cup.state for cup in cups) == ["ended", "running"]
        for cup in cups:
            ranks = [line.rank for of in board_of(session, cup).lines().values() for line in of]
            assert len(ranks) == COMPETITORS
            assert len(set(ranks)) > COMPETITORS / 3, "ranks differ"
        # Another day: the same two, and one that runs.
        later = now() + timedelta(days=2)
        hold_cups(session, DemoFilled(gym, owner, routes, (), {}, later))
        again = session.scalars(select(Competition).where(Competition.gym_id == gym.id)).all()
        assert [cup.id for cup in again] == [cup.id for cup in cups]
        assert [cup.ends_at is not None and cup.ends_at > later for cup in again] == [
            cup.state == "running" for cup in again
        ]


def test_that_all_is_made_up_stands_in_the_gyms_name_alone(world: World) -> None:
    assert NAME.endswith("(made up)")
    published(world)
    with world.server.database.writing() as session:
        gym, _, _ = with_cups(world, session)
        names = session.scalars(
            select(Person.name).where(Person.email.endswith(f"@{gym.slug}.invalid"))
        )
        cups = session.scalars(select(Competition.name).where(Competition.gym_id == gym.id))
        assert not [name for name in (*names, *cups) if "made" in name]


def test_every_route_is_named_and_the_harder_looking_graded_harder() -> None:
    steep = {n: FoundRoute(id=n, colour="red", steepness_deg=50.0 - 9 * n) for n in range(1, 5)}
    slab = {n: FoundRoute(id=n, colour="red", steepness_deg=-10.0 - n) for n in range(1, 10)}
    named = name_routes([steep, slab])
    assert len({str(facts["name"]) for of in named for facts in of.values()}) == 13
    assert [named[0][n]["grade"] for n in (3, 2, 1)] == ["6C", "6C+", "7A"]
    assert named[1][9]["grade"] == "4"


def test_the_demo_has_a_circuit_and_a_group_once(world: World) -> None:
    numbers = range(1, len(GRADES) + 1)
    scan = world.reviewed({n: [n] for n in numbers}, [hold(n, 0.1 * n, 1.0) for n in numbers])
    assert world.publish(scan, *({"number": n, "name": f"{n:02}"} for n in numbers)).is_success
    setter = world.people["setter"].id
    assert setter is not None
    with world.server.database.writing() as session:
        routes = graded(world, session)
        gym, wall = session.get_one(Gym, world.gym.id), session.get_one(Wall, world.wall.id)
        add_climbers(session, gym, routes, UNTIL)
        for _ in range(2):
            make_lists(session, DemoFilled(gym, setter, routes, [wall], {}, UNTIL))
        made = session.scalars(select(ClimbList).where(ClimbList.gym_id == gym.id)).all()
        assert sorted(one.circuit for one in made) == [False, True]
        assert all(one.items for one in made)
        (homework,) = (one for one in made if not one.circuit)
        assert len(group_progress(session, homework)) == 4


def test_the_tower_has_climbs_on_ropes_once(world: World) -> None:
    published(world)
    climber = world.people["member"].id
    assert climber is not None
    with world.server.database.writing() as session:
        filled(world, session)
        gym = session.get_one(Gym, world.gym.id)
        for _ in range(2):
            make_ropes(session, gym, climber, UNTIL)
        rows = session.scalars(select(Ascent).where(Ascent.discipline != "boulder")).all()
        assert len(rows) > 50
        for row in rows:
            route = session.get_one(Route, row.route_id)
            assert row.discipline in route.disciplines
            assert row.kind in kinds_of(Discipline(row.discipline))
            assert (row.high_point is not None) == (row.kind == Kind.HIGH_POINT)
            assert row.tries == 1 or row.kind not in FIRST_TRIES
    recount_gym(world.server.database, world.gym.id)
    with world.server.database.reading() as session:
        boards = session.scalars(select(Standing.discipline).distinct()).all()
    assert set(boards) == {"boulder", "lead", "top-rope"}


def test_climbers_made_problems_once(world: World) -> None:
    heights = {n: 0.4 * n for n in range(1, 9)}
    numbers = range(1, len(GRADES) + 1)
    ladder = [hold(n, 0.2 * (n % 3), z) for n, z in heights.items()]
    scan = world.reviewed({n: [1 + n % 8] for n in numbers}, ladder)
    assert world.publish(scan, *({"number": n, "name": f"{n:02}"} for n in numbers)).is_success
    versions = {world.wall.id: version_holds(world.server.services.store, scan)}
    with world.server.database.writing() as session:
        routes = graded(world, session)
        gym, wall = session.get_one(Gym, world.gym.id), session.get_one(Wall, world.wall.id)
        add_climbers(session, gym, routes, UNTIL)
        for _ in range(2):
            make_problems(session, DemoFilled(gym, uuid4(), routes, [wall], versions, UNTIL))
        assert session.scalar(select(func.count()).select_from(ProblemHold))
        made = select(Problem).where(Problem.wall_id == wall.id)
        problems = session.scalars(made.order_by(Problem.created_at)).all()
        assert len({problem.name for problem in problems}) == len(problems) >= 4
        for problem in problems:
            assert [used["use"] for used in problem.holds][0 :: len(problem.holds) - 1] == [
                "start",
                "top",
            ]
            steps = np.diff([heights[used["hold"]] for used in problem.holds])
            assert ((steps > 0.2) & (steps < 0.9)).all()
        assert session.scalar(select(func.count()).select_from(ProblemAscent))


def test_the_demo_sends_its_clip_once_to_the_route_of_its_colour(
    world: World, tmp_path: Path
) -> None:
    scan = world.reviewed({1: [1, 2], 2: [3, 4]}, HOLDS)
    entries = ({"number": 1, "name": "red"}, {"number": 2, "name": "blue"})
    assert world.publish(scan, *entries).is_success
    with world.server.database.writing() as session:
        for route in session.scalars(select(Route).where(Route.wall_id == world.wall.id)):
            route.colour = route.name
    video = tmp_path / "clip.mp4"
    video.write_bytes(b"no video, but bytes")
    server, climber = world.server, world.people["member"].id
    assert climber is not None
    for colour in ("blue", "blue", "green"):
        clip = DemoClip(video, world.wall.name, colour)
        to = (world.gym.id, climber)
        send_clip(server.settings, server.database, server.services.store, to, clip)
    with server.database.reading() as session:
        [row] = session.scalars(select(Clip).where(Clip.person_id == climber))
        assert (row.state, row.wants_film) == ("sent", True)
        assert session.get_one(Route, row.route_id).colour == "blue"
