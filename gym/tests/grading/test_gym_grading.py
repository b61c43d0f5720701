"""A gym's figures about its scale equal a plain recount, and ranges follow them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import UUID

import msgspec
import numpy as np
import pytest
from gym.tests.worlds import Server, World, hold, make_world
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import delete, select, update

from walltopo.scans import routes as found
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds, with_routes
from walltopo_climb.grades.calibrate import Known
from walltopo_climb.grades.font import FONT, V_OF
from walltopo_climb.grades.model import Errors, Learnt
from walltopo_gym.climbing.models import Opinion
from walltopo_gym.clock import now
from walltopo_gym.grading.models import PlacedRoute, ScanPlaces
from walltopo_gym.grading.placing import Placing
from walltopo_gym.grading.service import grade_outliers, ranges_of, scale_routes
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.publishing.models import Route
from walltopo_gym.scans.models import ScanEdits

LEARNT = Learnt(Errors(1.5, 2.0, 0.8), Errors(2.0, 2.7, 0.8), FONT.index("6A"), FONT.index("8A"))
MODEL = "aaaaaaaaaaaaaaaa"
PEOPLE, ROUTES = 8, 6
PLACES = [6.5, 8.0, 9.5, 7.0, 11.0, 12.5]
CIRCUITS = [
    {"label": "Blue", "colour": "#1e55b9", "low": "6A", "high": "6B+"},
    {"label": "Red", "colour": "#c32026", "low": "V5", "high": "V6"},
    {"label": "Our own"},
]
# Kind, labels, and what each means: first and last place on the Font scale.
SYSTEMS: dict[str, dict[str, tuple[int, int] | None]] = {
    "font": {"6A": (5, 5), "6B": (7, 7), "7A": (11, 11)},
    "v": {"VB": (0, 2), "V3": (5, 6), "V8": (13, 14)},
    "circuits": {"Blue": (5, 8), "Red": (9, 11), "Our own": None},
}


def place(world: World, scan: UUID, places: Sequence[float], model: str = MODEL) -> None:
    """Store made-up estimates as a worker does, for the routes 1, 2, ..."""
    with world.server.database.writing() as session:
        session.execute(delete(PlacedRoute).where(PlacedRoute.scan_id == scan))
        learnt = msgspec.to_builtins(LEARNT)
        session.merge(ScanPlaces(scan_id=scan, model=model, shown=0, learnt=learnt))
        session.flush()
        for number, at in enumerate(places, start=1):
            session.add(PlacedRoute(scan_id=scan, number=number, place=at, known=True))


def hang(world: World, routes: int) -> tuple[UUID, list[Route]]:
    """Publish a wall of so many routes; the scan, and the routes by their numbers."""
    numbers = range(1, routes + 1)
    holds = [hold(n, 0.2 * n, 1.0) for n in range(1, 2 * routes + 1)]
    scan = world.reviewed({n: [2 * n - 1, 2 * n] for n in numbers}, holds)
    entries = ({"number": n, "name": f"R{n:03d}"} for n in numbers)
    assert world.publish(scan, *entries).is_success
    with world.server.database.reading() as session:
        rows = select(Route).where(Route.wall_id == world.wall.id).order_by(Route.name)
        return scan, list(session.scalars(rows))


def add_systems(world: World) -> dict[str, UUID]:
    """One of each kind, by kind."""
    made = {}
    with world.server.database.writing() as session:
        for kind, labels in SYSTEMS.items():
            grades = CIRCUITS if kind == "circuits" else [{"label": label} for label in labels]
            row = GradeSystem(gym_id=world.gym.id, name=f"of {kind}", kind=kind, grades=grades)
            session.add(row)
            session.flush()
            made[kind] = row.id
    return made


def set_grade(world: World, route: UUID, **facts: Any) -> None:
    with world.server.database.writing() as session:
        session.execute(update(Route).where(Route.id == route).values(**facts))


@pytest.fixture(scope="module")
def hall(server: Server) -> tuple[World, list[Route], dict[str, UUID], list[UUID]]:
    """Six placed routes, systems of each kind, and climbers."""
    world = make_world(server)
    scan, routes = hang(world, ROUTES)
    place(world, scan, PLACES)
    people = [one.id for one in server.persons(*(f"c{n}" for n in range(PEOPLE))).values()]
    return world, routes, add_systems(world), [person for person in people if person is not None]


KINDS = st.sampled_from(["font", "v", "circuits", ""])
LABEL = st.integers(0, 2)


@settings(max_examples=20, deadline=None)
@given(
    grades=st.lists(
        st.tuples(KINDS, st.none() | LABEL, st.booleans()), min_size=ROUTES, max_size=ROUTES
    ),
    votes=st.lists(
        st.tuples(st.integers(0, PEOPLE - 1), st.integers(0, ROUTES - 1), LABEL),
        max_size=40,
        unique_by=lambda vote: vote[:2],
    ),
)
def test_figures_equal_a_plain_recount(hall: Any, grades: Any, votes: Any) -> None:
    world, routes, systems, people = hall
    labels = [list(SYSTEMS[kind]) if kind else [] for kind, _, _ in grades]
    with world.server.database.writing() as session:
        ids = [route.id for route in routes]
        session.execute(delete(Opinion).where(Opinion.route_id.in_(ids)))
        for route, (kind, label, gone), known in zip(routes, grades, labels, strict=True):
            values = {
                "grade_system_id": systems.get(kind),
                "grade": known[label] if known and label is not None else "",
                "stripped_at": now() - timedelta(days=400) if gone else None,
            }
            session.execute(update(Route).where(Route.id == route.id).values(**values))
        for who, which, label in votes:
            if labels[which]:
                vote = Opinion(
                    route_id=ids[which], person_id=people[who], grade=labels[which][label]
                )
                session.add(vote)
    with world.server.database.reading() as session:
        scaled = scale_routes(session, world.gym.id, MODEL)
    wanted = plain_recount(grades, votes)
    found = {one.id: one.known_grade for one in scaled}
    assert found.keys() == {routes[number].id for number in wanted}
    for number, one in wanted.items():
        its = found[routes[number].id]
        assert (its.difficulty, its.votes) == (one.difficulty, one.votes)
        # Rounded, two equal figures can differ: 0.4999995 and a bit less.
        assert (its.grade, its.width) == pytest.approx((one.grade, one.width), abs=1e-6)


def plain_recount(grades: Any, votes: Any) -> dict[int, Known]:
    """Route by route, vote by vote, with the formula of `climbing/shrinking.py`."""
    spans = [list(SYSTEMS[kind].values()) if kind else [None] * 3 for kind, _, _ in grades]
    setters: dict[int, Any] = {}
    given: dict[int, list[Any]] = {}
    for number, (_, label, gone) in enumerate(grades):
        if gone:
            continue  # more than a year ago
        setters[number] = None if label is None else spans[number][label]
        mine = [spans[number][vote] for _, which, vote in votes if which == number]
        given[number] = [span for span in mine if span is not None]
    given = {number: mine for number, mine in given.items() if len(mine) >= 3}
    off = {
        number: [sum(span) / 2 - sum(setters[number]) / 2 for span in mine]
        for number, mine in given.items()
        if setters[number] is not None
    }
    drawn = plain_shrunk(off)
    known_grades = {}
    for number, setter in setters.items():
        if number in given:
            mine = given[number]
            mean = float(np.mean([sum(span) / 2 for span in mine]))
            grade = mean if setter is None else sum(setter) / 2 + drawn[number]
            width = float(np.mean([high - low for low, high in mine]))
            known_grades[number] = Known(PLACES[number], grade, len(mine), width)
        elif setter is not None:
            known_grades[number] = Known(PLACES[number], sum(setter) / 2, 0, setter[1] - setter[0])
    return known_grades


def plain_shrunk(values: dict[int, list[float]]) -> dict[int, float]:
    items = {key: np.array(mine) for key, mine in values.items()}
    if len(items) < 2:
        return {key: float(mine.mean()) for key, mine in items.items()}
    every = np.concatenate(list(items.values()))
    inside = sum(((mine - mine.mean()) ** 2).sum() for mine in items.values())
    s2 = inside / (len(every) - len(items))
    apart = sum(len(mine) * (mine.mean() - every.mean()) ** 2 for mine in items.values())
    size = len(every) - sum(len(mine) ** 2 for mine in items.values()) / len(every)
    t2 = (apart / (len(items) - 1) - s2) / (size / (len(items) - 1))
    if t2 <= 1e-12:
        return dict.fromkeys(items, float(every.mean()))
    weights = {key: 1 / (t2 + s2 / len(mine)) for key, mine in items.items()}
    middle = sum(weights[key] * mine.mean() for key, mine in items.items()) / sum(weights.values())
    return {
        key: float(middle + t2 * weights[key] * (mine.mean() - middle))
        for key, mine in items.items()
    }


def ask(world: World, scan: UUID) -> Any:
    path = f"{world.path}/scans/{scan}/grade-ranges"
    answer = world.server.ask("GET", path, world.people["setter"])
    assert answer.is_success, answer.text
    return answer.json()


def ask_reach(world: World, scan: UUID) -> Any:
    path = f"{world.path}/scans/{scan}/reach"
    answer = world.server.ask("GET", path, world.people["setter"])
    assert answer.is_success, answer.text
    return answer.json()


def test_a_new_route_has_a_range_and_the_gyms_grades_move_it(world: World) -> None:
    scan, routes = hang(world, 8)
    system = add_systems(world)["font"]
    place(world, scan, [9.0] * 8)
    new = world.reviewed({1: [1], 2: [2]}, [hold(1, 0.0, 1.0), hold(2, 0.3, 1.0)])
    assert ask(world, new) == {
        "state": "waiting",
        "graded": 0,
        "voted": 0,
        "coverage": 0.0,
        "routes": [],
    }
    place(world, new, [9.0])  # no way was found up the second one
    payload = ask(world, new)
    assert (payload["state"], payload["graded"], payload["coverage"]) == ("ready", 0, 0.8)
    low, high = FONT.index("6B"), FONT.index("7A")
    in_v = {"low_v": f"V{V_OF[low]}", "high_v": f"V{V_OF[high]}"}
    assert payload["routes"] == [{"number": 1, "low": "6B", "high": "7A"} | in_v]
    for route in routes[:4]:
        set_grade(world, route.id, grade_system_id=system, grade="7A")
    harder = ask(world, new)
    assert (harder["graded"], harder["voted"]) == (4, 0)
    assert FONT.index(harder["routes"][0]["high"]) > high
    # Places of another model are not on this one's scale.
    place(world, scan, [9.0] * 8, model="another")
    assert ask(world, new)["graded"] == 0


def test_votes_count_from_three_on(world: World) -> None:
    scan, routes = hang(world, 1)
    system = add_systems(world)["font"]
    place(world, scan, [9.0])
    set_grade(world, routes[0].id, grade_system_id=system, grade="6A")
    new = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    place(world, new, [9.0])

    def middle() -> float:
        with world.server.database.reading() as session:
            found = ranges_of(session, world.gym.id, new)
            assert found is not None
            payload = scale_routes(session, world.gym.id, MODEL)
        assert found.voted == sum(one.known_grade.votes > 0 for one in payload)
        return payload[0].known_grade.grade

    seen = [middle()]
    for who in world.server.persons("a", "b", "c").values():
        with world.server.database.writing() as session:
            session.add(Opinion(route_id=routes[0].id, person_id=who.id, grade="7A"))
        seen.append(middle())
    assert seen == [5.0, 5.0, 5.0, pytest.approx(11.0)]


def test_edits_are_waited_for_and_what_is_published_has_no_range(world: World) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    place(world, scan, [9.0])
    with world.server.database.writing() as session:
        session.add(ScanEdits(scan_id=scan, revision=2, shown=2, log={}))
    assert ask(world, scan)["state"] == "waiting"
    with world.server.database.writing() as session:
        session.get_one(ScanPlaces, scan).shown = 2
    assert ask(world, scan)["state"] == "ready"
    assert world.publish(scan, {"number": 1}).is_success
    path = f"{world.path}/scans/{scan}/grade-ranges"
    assert world.server.ask("GET", path, world.people["setter"]).status_code == 409


def test_a_grade_outside_of_its_range_is_listed_with_its_side(world: World) -> None:
    count = 30
    scan, routes = hang(world, count)
    system = add_systems(world)["font"]
    grades = [FONT[5 + number % 10] for number in range(count)]
    world_system = [{"label": label} for label in FONT]
    with world.server.database.writing() as session:
        session.get_one(GradeSystem, system).grades = world_system
    rng = np.random.default_rng(3)
    places = [FONT.index(grade) + float(rng.normal(0, 0.3)) for grade in grades]
    places[0], places[1] = 14.0, 5.0  # 6A climbs like 7C, 6A+ like 6A
    places[9] = 5.0  # 7C+ climbs like 6A
    place(world, scan, places)
    with world.server.database.reading() as session:
        assert grade_outliers(session, world.gym.id).routes == []
    for route, grade in zip(routes, grades, strict=True):
        set_grade(world, route.id, grade_system_id=system, grade=grade)
    answer = world.server.ask("GET", f"{world.path}/insights", world.people["setter"]).json()
    assert (answer["outliers_graded"], answer["outliers_from"]) == (count, 20)
    sides = {row["route_id"]: row["side"] for row in answer["outliers"]}
    assert sides[str(routes[0].id)] == "hard"
    assert sides[str(routes[9].id)] == "soft"
    assert str(routes[5].id) not in sides
    by = [row["by"] for row in answer["outliers"]]
    assert by == sorted(by, reverse=True)
    path = f"{world.path}/insights/outliers.csv"
    table = world.server.ask("GET", path, world.people["setter"]).text.splitlines()
    assert len(table) == len(answer["outliers"]) + 1


@pytest.mark.slow
def test_a_worker_places_what_a_body_gets_up(world: World) -> None:
    """A ladder of jugs is climbed, holds out of reach of each other are not."""
    ladder = [hold(n, 0.2 * (n % 2), 0.4 + 0.35 * n) for n in range(1, 9)]
    apart = [hold(20, 5.0, 1.0), hold(21, 5.0, 5.0), hold(22, 5.0, 9.0)]
    holds = [*ladder, *apart]
    scan = world.reviewed({1: range(1, 9), 2: [20, 21, 22]}, holds)
    placing = Placing(world.server.database, world.server.services.store)
    assert ask_reach(world, scan)["state"] == "waiting"
    placing.place(str(scan))  # its holds are not there: none is placed
    assert ask(world, scan)["routes"] == []
    assert ask_reach(world, scan) == {
        "state": "ready",
        "heights": [1.2, 1.35, 1.5, 1.65, 1.8, 1.95],
        "arms": 0.05,
        "routes": [],
    }
    with TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        rows = (
            found.Route(id=1, colour="red", holds=tuple(range(1, 9)), start=(1,), top=(8,)),
            found.Route(id=2, colour="red", holds=(20, 21, 22), start=(20,), top=(22,)),
        )
        found.Routes(routes=rows).save(folder.routes)
        Holds(metric=True, holds=with_routes(holds, rows)).save(folder.holds)
        for path in (folder.routes, folder.holds):
            world.server.services.store.put(f"scans/{scan}/{path.name}", path)
    placing.place(str(scan))
    payload = ask(world, scan)
    assert [row["number"] for row in payload["routes"]] == [1]
    reach = {row["number"]: set(row["reached"]) for row in ask_reach(world, scan)["routes"]}
    assert reach == {1: {"yes"}, 2: {"no"}}
    with world.server.database.writing() as session:
        session.add(ScanEdits(scan_id=scan, revision=1, shown=1, log={}))
    assert ask_reach(world, scan)["state"] == "waiting"
