"""The setters' figures equal a plain count of every row."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from datetime import UTC, date, datetime, timedelta
from typing import Any
from uuid import UUID, uuid4

import numpy as np
import pytest
from gym.tests.worlds import Server, World, hold, make_world
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import delete, select, update

from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.counting import count_again
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.climbing.points import crowd_grade
from walltopo_gym.climbing.shrinking import Sample, shrunk_means
from walltopo_gym.clock import now
from walltopo_gym.gyms.models import GradeSystem, Gym
from walltopo_gym.insights.models import Washing
from walltopo_gym.insights.routes import OfRoute, routes_insight
from walltopo_gym.insights.stripping import what_to_strip
from walltopo_gym.insights.styles import styles
from walltopo_gym.insights.usage import ENOUGH, Usage, worn_walls
from walltopo_gym.publishing.models import Placement, Route

NOW = datetime(2026, 3, 4, 12, tzinfo=UTC)  # a Wednesday
LABELS = ("5", "6A", "6B", "7A")
PEOPLE, ROUTES = 12, 5
TOPS = ("flash", "top")


@pytest.fixture(scope="module")
def hall(server: Server) -> World:
    """Five routes of two setters on one wall, graded, of different steepness; the last is gone."""
    world = make_world(server)
    holds = [hold(n, 0.2 * n, 1.0) for n in range(1, 2 * ROUTES + 1)]
    numbers = range(1, ROUTES + 1)
    scan = world.reviewed({n: [2 * n - 1, 2 * n] for n in numbers}, holds)
    assert world.publish(scan, *({"number": n, "name": f"R{n}"} for n in numbers)).is_success
    with server.database.writing() as session:
        system = GradeSystem(
            gym_id=world.gym.id,
            name="F",
            kind="font",
            grades=[{"label": label} for label in LABELS],
        )
        session.add(system)
        session.flush()
        for at, route in enumerate(_routes(session, world)):
            route.grade_system_id, route.grade = system.id, LABELS[at % len(LABELS)]
            route.setter = ("Ada", "Ben")[at % 2]
            route.set_on = date(2025, 12, 1)
            placed = update(Placement).where(Placement.route_id == route.id)
            session.execute(placed.values(steepness_deg=(-20.0, 0.0, 30.0)[at % 3]))
            if at == ROUTES - 1:
                route.stripped_at = NOW
    return world


def _routes(session: Any, world: World) -> Sequence[Route]:
    rows = select(Route).where(Route.wall_id == world.wall.id).order_by(Route.name)
    return list(session.scalars(rows))


WHO, WHICH = st.integers(0, PEOPLE - 1), st.integers(0, ROUTES - 1)
ASCENTS = st.tuples(
    WHO,
    WHICH,
    st.sampled_from(["flash", "top", "zone", "try", "project"]),
    st.integers(1, 4),
    st.integers(1, 80),
    st.booleans(),
)
OPINIONS = st.tuples(
    WHO,
    WHICH,
    st.sampled_from(["", *LABELS, "9A"]),
    st.sampled_from([None, 1, 2, 3, 4, 5]),
    st.sampled_from(["", "keep", "renew"]),
)


@settings(max_examples=15, deadline=None)
@given(
    ascents=st.lists(ASCENTS, min_size=10, max_size=90),
    opinions=st.lists(OPINIONS, max_size=30, unique_by=lambda row: row[:2]),
    gone=st.sets(WHO, max_size=3),
    washed=st.none() | st.integers(2, 70),
)
def test_figures_equal_a_plain_recount(
    server: Server,
    hall: World,
    ascents: list[Any],
    opinions: list[Any],
    gone: set[int],
    washed: int | None,
) -> None:
    people = _people(server, hall)
    moment = None if washed is None else NOW - timedelta(days=washed)
    with server.database.writing() as session:
        session.execute(delete(Ascent).where(Ascent.gym_id == hall.gym.id))
        session.execute(delete(Washing).where(Washing.wall_id == hall.wall.id))
        routes = _routes(session, hall)
        session.execute(delete(Opinion).where(Opinion.route_id.in_([r.id for r in routes])))
        for who, which, kind, tries, days, back in ascents:
            at = NOW - timedelta(days=days)
            tries = 1 if kind == "flash" else tries
            _add_ascent(session, hall, people[who], routes[which], kind, tries, at, back)
        for who, which, grade, stars, wish in opinions:
            opinion = {"grade": grade, "stars": stars, "wish": wish}
            row = Opinion(person_id=people[who], route_id=routes[which].id, **opinion)
            row.changed_at = NOW - timedelta(days=9)
            session.add(row)
        if moment is not None:
            session.add(Washing(wall_id=hall.wall.id, washed_at=moment))
        session.flush()
        gym = session.get_one(Gym, hall.gym.id)
        for person in people:
            count_again(session, gym, person, None)
        session.execute(delete(Person).where(Person.id.in_([people[who] for who in gone])))
    with server.database.reading() as session:
        gym = session.get_one(Gym, hall.gym.id)
        rows = session.scalars(select(Ascent).where(Ascent.gym_id == gym.id)).all()
        votes = session.scalars(
            select(Opinion).where(Opinion.route_id.in_([r.id for r in routes]))
        ).all()
        _compare_routes(routes_insight(session, gym, NOW), routes, rows, votes, moment)
        _compare_wall(worn_walls(session, gym.id), hall, routes, rows, moment)
        _compare_styles(styles(session, gym, NOW, "bands"), routes, rows, votes)


def _people(server: Server, hall: World) -> list[UUID]:
    made = server.persons(*(f"climber{n}" for n in range(PEOPLE))).values()
    return [person.id for person in made if person.id is not None]


def _add_ascent(
    session: Any,
    hall: World,
    person: UUID,
    route: Route,
    kind: str,
    tries: int,
    at: datetime,
    back: bool,
) -> None:
    session.add(
        Ascent(
            id=uuid4(),
            person_id=person,
            gym_id=hall.gym.id,
            route_id=route.id,
            gym_name="G",
            route_name=route.name,
            grade=route.grade,
            kind=kind,
            tries=tries,
            climbed_at=at,
            taken_back_at=NOW if back else None,
        )
    )


def plain_usage(
    rows: Iterable[Ascent], route: UUID, since: datetime, washed: datetime | None
) -> Usage:
    """Count the usage of one route, row by row."""
    mine = [r for r in rows if r.route_id == route and r.taken_back_at is None]
    mine = [r for r in mine if r.kind != "project"]
    recent = [r for r in mine if r.climbed_at >= since]
    return Usage(
        ascents=len(mine),
        climbers=len({r.person_id for r in mine if r.kind in TOPS}),
        tried=len({r.person_id for r in mine}),
        flashed=len({r.person_id for r in mine if r.kind == "flash"}),
        tries=sum(r.tries for r in mine),
        recent=len(recent),
        recent_people=len({r.person_id for r in recent}),
        earlier_people=len({r.person_id for r in mine if r.climbed_at < since}),
        worn=sum(r.tries for r in mine if washed is None or r.climbed_at >= washed),
    )


def _compare_routes(
    result: Any,
    routes: Sequence[Route],
    rows: Sequence[Ascent],
    votes: Sequence[Opinion],
    washed: datetime | None,
) -> None:
    since = NOW - timedelta(days=28)
    plain = {route.id: plain_usage(rows, route.id, since, washed) for route in routes}
    stars = plain_shrunk(
        {r.id: [v.stars for v in votes if v.route_id == r.id and v.stars] for r in routes}
    )
    off = plain_shrunk(
        {
            r.id: [
                LABELS.index(v.grade) - LABELS.index(r.grade)
                for v in votes
                if v.route_id == r.id and v.grade in LABELS
            ]
            for r in routes
        }
    )
    flashes = plain_shrunk(
        {key: [1] * use.flashed + [0] * (use.climbers - use.flashed) for key, use in plain.items()}
    )
    assert [one.id for one in result.routes] == [route.id for route in routes[:-1]]
    for one in result.routes:
        use, mine = plain[one.id], [v for v in votes if v.route_id == one.id]
        assert one.use == use
        assert one.stars == _close(stars.get(one.id), 0.006)
        assert one.off == _close(off.get(one.id), 0.006)
        enough = use.climbers >= ENOUGH
        assert one.flash_rate == (_close(flashes[one.id], 0.0006) if enough else None)
        given = Counter(v.grade for v in mine if v.grade)
        assert one.crowd == crowd_grade(given, LABELS)
        assert (one.votes, one.grade_votes, one.keep, one.renew) == (
            sum(v.stars is not None for v in mine),
            sum(v.grade in LABELS for v in mine),
            sum(v.wish == "keep" for v in mine),
            sum(v.wish == "renew" for v in mine),
        )
        groups = (use.recent_people, use.earlier_people)
        assert one.recent == (use.recent if not any(0 < n < ENOUGH for n in groups) else None)
    for setter in result.setters:
        mine_too = {route.id for route in routes if route.setter == setter.setter}
        counted = [r for r in rows if r.route_id in mine_too and not r.taken_back_at]
        climbers = {r.person_id for r in counted if r.kind in TOPS}
        ascents = sum(r.kind != "project" for r in counted)
        shown = (ascents, len(climbers)) if len(climbers) >= ENOUGH else (None, None)
        assert (setter.ascents, setter.climbers) == shown
        assert setter.routes == len(mine_too)


def _close(value: float | None, by: float) -> Any:
    return None if value is None else pytest.approx(value, abs=by)


def _compare_wall(
    result: dict[UUID, int | None],
    hall: World,
    routes: Sequence[Route],
    rows: Sequence[Ascent],
    washed: datetime | None,
) -> None:
    current = {route.id for route in routes[:-1]}
    counted = [r for r in rows if r.route_id in current and not r.taken_back_at]
    counted = [r for r in counted if r.kind != "project"]
    since = [r for r in counted if washed is None or r.climbed_at >= washed]
    before = [r for r in counted if washed is not None and r.climbed_at < washed]
    few = any(0 < len({r.person_id for r in some}) < ENOUGH for some in (since, before))
    wanted = None if few else sum(r.tries for r in since)
    assert result.get(hall.wall.id, 0) == wanted


def _compare_styles(
    result: Any, routes: Sequence[Route], rows: Sequence[Ascent], votes: Sequence[Opinion]
) -> None:
    """Up to Monday morning; each published number is a plain count of enough people."""
    monday = datetime(2026, 3, 2, 4, tzinfo=UTC)
    assert result.until == monday
    counted = [r for r in rows if not r.taken_back_at and r.kind != "project"]
    counted = [r for r in counted if r.climbed_at < monday]
    best: dict[UUID, int] = defaultdict(lambda: -1)
    for r in counted:
        best[r.person_id] = max(best[r.person_id], (r.worth or 0) if r.kind in TOPS else -1)
    bands = {
        person: "none" if worth < 0 else str(sum(worth >= w for w in (200, 280, 360)))
        for person, worth in best.items()
    }
    sizes = Counter(bands.values())
    assert sum(group.size for group in result.groups) in (0, len(bands))
    assert all(
        group.size == sum(sizes[part] for part in group.parts) >= ENOUGH for group in result.groups
    )
    names = {-20.0: "slab", 0.0: "vertical", 30.0: "steep"}
    kind = {route.id: names[(-20.0, 0.0, 30.0)[at % 3]] for at, route in enumerate(routes)}
    for line in (line for line in result.lines if line.kind == "steepness"):
        mine = [r for r in counted if r.route_id and kind[r.route_id] == line.value]
        for parts, cell in [(set(sizes), line)] + [
            (set(g.parts), line.cells[g.key]) for g in result.groups
        ]:
            these = [r for r in mine if bands[r.person_id] in parts]
            if cell.tried is not None:
                assert len({r.person_id for r in these}) not in range(1, ENOUGH)
                assert cell.tried == len({(r.person_id, r.route_id) for r in these})
                tops = {(r.person_id, r.route_id) for r in these if r.kind in TOPS}
                assert cell.topped == len(tops)
            if cell.votes is not None:
                voted = [v for v in votes if v.stars and bands.get(v.person_id) in parts]
                voted = [v for v in voted if kind[v.route_id] == line.value]
                assert cell.votes == len(voted)
                assert len({v.person_id for v in voted}) not in range(1, ENOUGH)


def plain_shrunk(values: dict[Any, list[Any]]) -> dict[Any, float]:
    """The formula of `shrinking.py`, over the values themselves."""
    items = {key: np.array(given, float) for key, given in values.items() if given}
    if len(items) < 2:
        return {key: float(given.mean()) for key, given in items.items()}
    every = np.concatenate(list(items.values()))
    if len(every) == len(items):
        return dict.fromkeys(items, float(every.mean()))
    s2 = sum(((g - g.mean()) ** 2).sum() for g in items.values()) / (len(every) - len(items))
    apart = sum(len(g) * (g.mean() - every.mean()) ** 2 for g in items.values())
    apart /= len(items) - 1
    size = (len(every) - sum(len(g) ** 2 for g in items.values()) / len(every)) / (len(items) - 1)
    t2 = max(0.0, (apart - s2) / size)
    if t2 < 1e-12:
        return dict.fromkeys(items, float(every.mean()))
    weights = {key: 1 / (t2 + s2 / len(g)) for key, g in items.items()}
    m = sum(weights[key] * g.mean() for key, g in items.items()) / sum(weights.values())
    return {key: float(m + t2 / (t2 + s2 / len(g)) * (g.mean() - m)) for key, g in items.items()}


@given(values=st.lists(st.lists(st.integers(1, 5), max_size=8), max_size=6))
def test_a_shrunk_mean_is_the_formula_and_lies_between(values: list[list[int]]) -> None:
    items = dict(enumerate(values))
    samples = {k: Sample(len(g), sum(g), sum(v * v for v in g)) for k, g in items.items()}
    found, plain = shrunk_means(samples), plain_shrunk(items)
    assert found.keys() == plain.keys()
    for key, value in found.items():
        assert value == pytest.approx(plain[key], abs=1e-6)
        assert 1 - 1e-9 <= value <= 5 + 1e-9


def a_route(**facts: Any) -> OfRoute:
    plain: dict[str, Any] = {
        "wall_id": UUID(int=0),
        "number": 1,
        "name": "",
        "colour": "red",
        "system": None,
        "grade": "",
        "setter": "",
        "steepness": "",
        "set_on": NOW.date(),
        "strip_on": None,
        "age": 30,
        "use": Usage(recent=10),
        "ascents": 10,
        "climbers": 0,
        "recent": None,
        "flash_rate": None,
        "stars": None,
        "votes": 0,
        "crowd": "",
        "grade_votes": 0,
        "off": None,
        "keep": 0,
        "renew": 0,
    }
    return OfRoute(**({"id": uuid4()} | plain | facts))


def test_what_to_strip_has_its_reasons_and_order() -> None:
    rest = [a_route(stars=4.0, votes=5) for _ in range(4)]
    old = a_route(age=60)
    older = a_route(age=61, keep=0, renew=0)
    kept = a_route(age=80, keep=3, renew=1)
    worst = a_route(age=57, stars=2.0, votes=4, renew=2, use=Usage(recent=1, worn=200))
    planned = a_route(age=3, strip_on=NOW.date() + timedelta(days=6), use=Usage())
    suggestions = what_to_strip([*rest, old, kept, worst, planned, older], NOW.date(), 150)
    assert [one.route_id for one in suggestions] == [worst.id, older.id, old.id, planned.id]
    assert suggestions[0].reasons == ("old", "quiet", "disliked", "renew", "worn")
    assert suggestions[-1].reasons == ("planned",)


@pytest.mark.usefixtures("midday")
def test_by_the_page_wishes_stock_and_washing(world: World) -> None:
    holds = [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4, size=0.3), hold(3, 1.0, 1.0, colour="blue")]
    assert world.publish(world.reviewed({1: [1, 2]}, holds), {"number": 1}).is_success
    setter, path = world.people["setter"], f"{world.path}/insights"

    def ask(method: str, where: str, body: object = None) -> Any:
        answer = world.server.ask(method, world.path + where, setter, body)
        assert answer.is_success, answer.text
        return answer.json()

    systems = ask("GET", "/grade-systems")
    wish = {
        "cells": [
            {"system": systems[0]["id"], "grade": "6A", "routes": 4},
            {"steepness": "slab", "routes": 2},
        ]
    }
    table = ask("PUT", "/insights/targets", wish)["targets"]
    assert [(w["grade"], w["steepness"], w["current"], w["target"]) for w in table] == [
        ("6A", "", 0, 4),
        ("", "slab", 0, 2),
        ("", "vertical", 1, None),
    ]
    wrong = {"cells": [{"system": systems[0]["id"], "grade": "12", "routes": 4}]}
    assert world.server.ask("PUT", f"{path}/targets", setter, wrong).status_code == 422
    rows = [{"colour": "red", "type": "", "total": 10}, {"colour": "blue", "total": 0}]
    payload = ask("PUT", "/insights/stock", {"rows": rows, "wash_after": 5})
    free = {(row["colour"], row["type"]): row["free"] for row in payload["stock"]}
    assert free == {
        ("red", ""): 8,
        ("red", "unknown"): None,
        ("blue", ""): -1,
        ("blue", "unknown"): None,
    }
    sizes = {(row["colour"], row["size"], row["holds"]) for row in payload["holds"]}
    assert sizes == {("red", "m", 1), ("red", "l", 1), ("blue", "m", 1)}
    route = world.published()["routes"][0]["id"]
    body = {
        "route_id": route,
        "kind": "top",
        "tries": 7,
        "climbed_at": (now() - timedelta(hours=1)).isoformat(),
    }
    ascent = f"{world.path}/ascents/{uuid4()}"
    assert world.server.ask("PUT", ascent, world.people["member"], body).is_success
    wear = ask("GET", "/insights/holds")["wear"][0]
    assert (wear["due"], wear["tries"], wear["washed_at"]) == (1, None, None)
    wall = f"/walls/{world.wall.id}/washings"
    wear = ask("POST", wall)["wear"][0]
    assert (wear["due"], wear["washed_at"] is not None) == (0, True)
    wear = ask("DELETE", f"{wall}/{wear['washing_id']}")["wear"][0]
    assert (wear["due"], wear["washed_at"]) == (1, None)
    table = world.server.ask("GET", f"{path}/stock.csv", setter).text.splitlines()
    assert table[:2] == ["\ufeffcolour,type,current,total,free", "blue,,1,0,-1"]


def test_a_reset_lists_what_stayed_came_and_went(world: World) -> None:
    holds = [hold(n, 0.4 * n, 1.0) for n in range(1, 7)]
    first = world.reviewed({1: [1, 2], 2: [3, 4]}, holds)
    assert world.publish(first, {"number": 1}, {"number": 2}).is_success
    stays = world.published()["routes"][0]["id"]
    second = world.reviewed({1: [1, 2], 2: [5, 6], 3: [3]}, holds)
    entries = [{"number": 1, "route_id": stays}, {"number": 2}, {"number": 3}]
    assert world.publish(second, *entries, revision=1).is_success
    path = f"{world.path}/walls/{world.wall.id}/resets"
    payload = world.server.ask("GET", path, world.people["setter"]).json()
    assert [(r["stayed"], r["came"], r["went"], r["weeks"]) for r in payload] == [(1, 2, 1, 0)]
    assert (payload[0]["before"]["routes"], payload[0]["after"]["routes"]) == (2, 3)
