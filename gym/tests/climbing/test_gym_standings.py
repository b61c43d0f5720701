"""Counts that are updated with each change equal a plain count of the ascents."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID, uuid4
from zoneinfo import ZoneInfo

import pytest
from gym.tests.hurried import do_all
from gym.tests.server.test_gym_transactions import counted
from gym.tests.worlds import Server, Somebody, World, hold, make_world
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import select, update

from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.models import Profile
from walltopo_gym.climbing.ascents import NewAscent, store_ascent, withdraw
from walltopo_gym.climbing.boards import BoardQuery, board
from walltopo_gym.climbing.counting import RECOUNTS, recount_gym
from walltopo_gym.climbing.kinds import Kind, kinds_of
from walltopo_gym.climbing.models import Ascent, ClimbingSession, Standing
from walltopo_gym.climbing.sessions import ascents_of
from walltopo_gym.clock import now
from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.models import GradeSystem, Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.jobs.queue import Task
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.service import strip_without_scan
from walltopo_gym.walls.disciplines import Discipline

GRADES = [
    {"label": "Green", "colour": "#289141", "low": "5", "high": "6A"},
    {"label": "Blue", "colour": "#1e55b9", "low": "6A", "high": "6B+"},
]
WORTH = {"Green": 180, "Blue": 230}
BEGAN = datetime(2025, 12, 30, 12, tzinfo=UTC)


@pytest.fixture(scope="module")
def hall(server: Server) -> World:
    """A gym with two circuits and four routes, in a zone that is far from UTC."""
    world = make_world(server)
    with server.database.writing() as session:
        session.get_one(Gym, world.gym.id).time_zone = "America/Los_Angeles"
        system = GradeSystem(gym_id=world.gym.id, name="Ours", kind="circuits", grades=GRADES)
        session.add(system)
        session.flush()
        for number in range(4):
            grade = ("Green", "Blue")[number % 2]
            session.add(
                Route(
                    wall_id=world.wall.id,
                    name=f"R{number}",
                    grade_system_id=system.id,
                    grade=grade,
                    set_on=BEGAN.date(),
                )
            )
    world.gym.time_zone = "America/Los_Angeles"
    return world


CHANGES = st.one_of(
    st.tuples(
        st.just("put"),
        st.integers(0, 7),
        st.integers(0, 2),
        st.integers(0, 3),
        st.sampled_from(kinds_of(Discipline.BOULDER)),
        st.integers(0, 5 * 24 * 4),
    ),
    st.tuples(st.just("drop"), st.integers(0, 7)),
    st.tuples(st.just("strip"), st.integers(0, 3)),
    st.tuples(st.just("show"), st.integers(0, 2), st.booleans()),
)


@settings(max_examples=12, deadline=None)
@given(changes=st.lists(CHANGES, min_size=4, max_size=14))
def test_whatever_happens_the_count_is_a_plain_recount(
    server: Server, hall: World, changes: list[tuple[Any, ...]]
) -> None:
    people = [person.id for person in server.persons("a", "b", "c").values() if person.id]
    keys = [uuid4() for _ in range(8)]
    owner: dict[UUID, UUID] = {}
    with server.database.writing() as session:
        for person in people:
            add_member(session, hall.gym.id, person, Role.MEMBER, person)
    routes = _routes(server, hall)
    for change in changes:
        with server.database.writing() as session:
            _carry_out(session, hall, change, people, keys, owner, routes)
    with server.database.reading() as session:
        gym = session.get_one(Gym, hall.gym.id)
        rows = session.scalars(
            select(Ascent).where(Ascent.person_id.in_(people), Ascent.taken_back_at.is_(None))
        ).all()
        counted = session.scalars(select(Standing).where(Standing.person_id.in_(people)))
        assert {
            (row.person_id, row.period, row.circuit): (row.points, row.tops, row.flashes)
            for row in counted
        } == plain_standings(rows)
        assert _sessions(session, people) == plain_sessions(rows)
        _compare_board(session, gym)
    with server.database.writing() as session:  # and counting all of it anew changes nothing
        before = _all(session, people)
        for person in people:
            session.execute(update(Ascent).where(Ascent.person_id == person).values(worth=None))
    recount_gym(server.database, hall.gym.id)
    with server.database.reading() as session:
        assert _all(session, people) == before


def _routes(server: Server, hall: World) -> list[UUID]:
    with server.database.writing() as session:
        hung = update(Route).where(Route.wall_id == hall.wall.id).values(stripped_at=None)
        session.execute(hung)
        rows = select(Route.id).where(Route.wall_id == hall.wall.id).order_by(Route.name)
        return list(session.scalars(rows))


def _carry_out(
    session: Any,
    hall: World,
    change: tuple[Any, ...],
    people: list[UUID],
    keys: list[UUID],
    owner: dict[UUID, UUID],
    routes: list[UUID],
) -> None:
    gym = session.get_one(Gym, hall.gym.id)
    if change[0] == "put":
        _, number, who, which, kind, quarter = change
        key = keys[number]
        kept = session.get(Ascent, key)
        route = routes[which] if kept is None else kept.route_id
        person = owner.setdefault(key, people[who])
        moment = BEGAN + timedelta(minutes=15 * quarter)
        tries = 1 if kind == Kind.FLASH else 2
        climb = NewAscent(route_id=route, kind=kind, tries=tries, climbed_at=moment)
        store_ascent(session, key, person, gym, session.get_one(Route, route), climb)
    elif change[0] == "drop":
        key = keys[change[1]]
        if key in owner:
            withdraw(session, key, owner[key])
    elif change[0] == "strip":
        route = session.get_one(Route, routes[change[1]])
        if route.stripped_at is None:
            strip_without_scan(session, route)
    else:
        session.merge(Profile(person_id=people[change[1]], on_boards=change[2], feed=True))


def _day(moment: datetime) -> Any:
    return (moment - timedelta(hours=4)).astimezone(ZoneInfo("America/Los_Angeles")).date()


def plain_standings(rows: Iterable[Ascent]) -> dict[tuple[UUID, str, str], tuple[int, int, int]]:
    """Counted the long way. No clock is put on or back between the days of these tests."""
    best: dict[tuple[UUID, str, str], dict[UUID | None, list[int]]] = defaultdict(dict)
    for row in rows:
        if row.kind in ("flash", "top"):
            points = WORTH[row.grade] + (10 if row.kind == "flash" else 0)
            for period in (str(_day(row.climbed_at))[:7], str(_day(row.climbed_at))[:4], "all"):
                for circuit in ("", row.grade):
                    of = best[row.person_id, period, circuit]
                    of.setdefault(row.route_id, []).append(points)
    return {
        key: (
            sum(sorted((max(points) for points in of.values()), reverse=True)[:10]),
            len(of),
            sum(any(p in (190, 240) for p in points) for points in of.values()),
        )
        for key, of in best.items()
    }


def plain_sessions(rows: Iterable[Ascent]) -> set[tuple[Any, ...]]:
    """Person, day, first and last moment, ascents."""
    of: dict[tuple[UUID, Any], list[list[datetime]]] = defaultdict(list)
    for row in sorted(rows, key=lambda row: row.climbed_at):
        groups = of[row.person_id, _day(row.climbed_at)]
        if not groups or row.climbed_at - groups[-1][-1] >= timedelta(hours=4):
            groups.append([])
        groups[-1].append(row.climbed_at)
    return {
        (person, day, group[0], group[-1], len(group))
        for (person, day), groups in of.items()
        for group in groups
    }


def _sessions(session: Any, people: list[UUID]) -> set[tuple[Any, ...]]:
    rows = session.scalars(select(ClimbingSession).where(ClimbingSession.person_id.in_(people)))
    return {(r.person_id, r.day, r.began_at, r.ended_at, r.ascents) for r in rows}


def _all(session: Any, people: list[UUID]) -> tuple[Any, ...]:
    standings = session.scalars(select(Standing).where(Standing.person_id.in_(people)))
    visits = session.scalars(select(ClimbingSession).where(ClimbingSession.person_id.in_(people)))
    return (
        {(r.person_id, r.period, r.circuit, r.points, r.tops, r.flashes) for r in standings},
        {(r.id, r.began_at, r.ascents, r.tops, r.flashes, r.points, r.hardest) for r in visits},
    )


def _compare_board(session: Any, gym: Gym) -> None:
    """Return listed people, ranked by how many have more, of all who ever climbed here."""
    of = select(Ascent).where(Ascent.gym_id == gym.id, Ascent.taken_back_at.is_(None))
    counted = plain_standings(session.scalars(of))
    shown = set(session.scalars(select(Profile.person_id).where(Profile.on_boards)))
    points = {
        person: sums[0]
        for (person, period, circuit), sums in counted.items()
        if (period, circuit) == ("all", "Blue") and person in shown
    }
    wanted = {p: 1 + sum(more > mine for more in points.values()) for p, mine in points.items()}
    payload = board(session, gym, BoardQuery("all", "Blue"), uuid4(), now(), 200, 0)
    assert {line.person_id: line.rank for line in payload.lines} == wanted
    assert payload.of == len(wanted)
    assert [line.rank for line in payload.lines] == sorted(wanted.values())


def tick(world: World, who: Somebody, route: str, **words: Any) -> None:
    body = {"route_id": route, "kind": "top", "tries": 2, "climbed_at": now().isoformat()} | words
    answer = world.server.ask("PUT", f"{world.path}/ascents/{uuid4()}", who, body)
    assert answer.is_success, answer.text


def show(world: World, who: Somebody, **words: Any) -> None:
    body = {"on_boards": True, **words}
    assert world.server.ask("PUT", "/me/profile", who, body).is_success


def read(world: World, path: str, who: str = "member") -> Any:
    answer = world.server.ask("GET", world.path + path, world.people[who])
    assert answer.status_code == 200, answer.text
    return answer.json()


@pytest.fixture
def routes(world: World) -> list[str]:
    """Three routes that hang: 6A, 6B, 7A."""
    holds = [hold(n, 0.3 * n, 1.0) for n in range(1, 7)]
    scan = world.reviewed({1: [1, 2], 2: [3, 4], 3: [5, 6]}, holds)
    assert world.publish(scan, *({"number": n, "name": f"R{n}"} for n in (1, 2, 3))).is_success
    with world.server.database.writing() as session:
        system = GradeSystem(
            gym_id=world.gym.id, name="F", kind="font", grades=[{"label": g} for g in FONT]
        )
        session.add(system)
        session.flush()
        found = session.scalars(
            select(Route).where(Route.wall_id == world.wall.id).order_by(Route.name)
        ).all()
        for route, grade in zip(found, ("6A", "6B", "7A"), strict=True):
            route.grade, route.grade_system_id = grade, system.id
            route.set_on = BEGAN.date()
        return [str(route.id) for route in found]


@pytest.mark.usefixtures("midday")
def test_a_board_names_only_who_wants_it_and_ties_are_ties(world: World, routes: list[str]) -> None:
    people = world.people
    for who in ("owner", "member", "judge"):
        tick(world, people[who], routes[0])
    tick(world, people["owner"], routes[2], kind="flash", tries=1)
    tick(world, people["setter"], routes[2])
    for who in ("owner", "member", "judge"):
        show(world, people[who], category="women" if who == "judge" else "men")
    payload = read(world, "/board")
    assert [(line["rank"], line["points"]) for line in payload["lines"]] == [
        (1, 530),
        (2, 200),
        (2, 200),
    ]
    hidden = read(world, "/board", "setter")
    assert (hidden["own"]["rank"], hidden["own"]["points"], hidden["shown"]) == (2, 320, False)
    assert str(people["setter"].id) not in {line["person_id"] for line in hidden["lines"]}
    # The rank of a page's first line is counted, too.
    assert [line["rank"] for line in read(world, "/board?skip=2")["lines"]] == [2]
    # Categories are the gym's choice.
    assert read(world, "/board?category=women")["of"] == 3
    changed = {"boards": "categories"}
    assert world.server.ask("PATCH", world.path, world.owner, changed).is_success
    assert read(world, "/board?category=women")["of"] == 1
    assert world.server.ask("PATCH", world.path, world.owner, {"boards": "off"}).is_success
    assert world.server.ask("GET", f"{world.path}/board", people["judge"]).status_code == 404


@pytest.mark.usefixtures("midday")
def test_follows_need_consent_and_a_feed_can_be_off(world: World, routes: list[str]) -> None:
    server, people = world.server, world.people
    member, judge = people["member"], people["judge"]
    tick(world, judge, routes[1], kind="flash", tries=1)
    show(world, judge, show_ascents="followers")
    path = f"/me/following/{judge.id}"
    assert server.ask("PUT", path, member).json() == {"accepted": False}
    assert read(world, "/feed") == {"on": True, "items": []}
    visit = read(world, "/sessions", "judge")[0]["id"]
    alone = f"{world.path}/sessions/{visit}"
    assert server.ask("GET", alone, member).status_code == 404
    assert server.ask("PUT", f"/me/followers/{member.id}", judge).is_success
    assert [item["name"] for item in read(world, "/feed")["items"]] == ["judge"]
    assert server.ask("GET", alone, member).json()["own"] is False
    friends = read(world, f"/routes/{routes[1]}/friends")
    assert [(friend["name"], friend["kind"]) for friend in friends] == [("judge", "flash")]
    assert read(world, "/board?friends=true")["of"] == 1
    assert server.ask("PUT", "/me/feed", member, {"on": False}).is_success
    assert read(world, "/feed") == {"on": False, "items": []}
    show(world, judge, show_ascents="nobody")
    assert read(world, f"/routes/{routes[1]}/friends") == []
    # Nobody outside one's gyms can be tried out, nor oneself.
    stranger = people["stranger"]
    assert server.ask("PUT", f"/me/following/{stranger.id}", member).status_code == 404
    assert server.ask("PUT", f"/me/following/{member.id}", member).status_code == 422
    assert server.ask("DELETE", f"/me/followers/{member.id}", judge).is_success
    assert server.ask("GET", "/me/follows", member).json()["following"] == []


@pytest.mark.usefixtures("midday")
def test_progress_says_what_was_climbed(world: World, routes: list[str]) -> None:
    member = world.people["member"]
    for weeks in (9, 8, 1, 0):
        moment = now() - timedelta(weeks=weeks)
        tick(world, member, routes[0], climbed_at=moment.isoformat())
    tick(world, member, routes[2], kind="flash", tries=1)
    tick(world, member, routes[1], kind="try", tries=4)
    payload = read(world, "/progress")
    assert (payload["sessions"], payload["ascents"], payload["routes"], payload["flashes"]) == (
        4,
        6,
        2,
        1,
    )
    assert (payload["tries"], payload["streak"], payload["longest"]) == (13, 2, 2)
    assert [(row["grade"], row["routes"]) for row in payload["grades"]] == [("6A", 1), ("7A", 1)]
    assert payload["months"][-1]["hardest"] == "7A"
    assert [week["sessions"] for week in payload["weeks"]] == [1, 1, 0, 0, 0, 0, 0, 0, 1, 1]
    assert [(row["grade"], row["done"], row["of"]) for row in payload["current"]] == [
        ("6A", 1, 1),
        ("6B", 0, 1),
        ("7A", 1, 1),
    ]
    with world.server.database.writing() as session:
        for route, (degrees, types) in zip(
            routes, ((-12.0, {"crimp": 3, "jug": 1}), (0.0, {}), (30.0, {"jug": 2})), strict=True
        ):
            these = update(Placement).where(Placement.route_id == UUID(route))
            session.execute(these.values(steepness_deg=degrees, hold_types=types))
    payload = read(world, "/progress")
    assert [tuple(row.values()) for row in payload["steepness"]] == [
        ("slab", 1, 1, 0),
        ("vertical", 1, 0, 0),
        ("steep", 1, 1, 1),
    ]
    assert [tuple(row.values()) for row in payload["holds"]] == [
        ("crimp", 1, 1, 0),
        ("jug", 1, 1, 1),
    ]
    table = world.server.ask("GET", f"{world.path}/progress/grades.csv", member)
    assert table.text.splitlines() == [
        "\ufeffgrade,worth,routes,flashes",
        "6A,200,1,0",
        "7A,320,1,1",
    ]


@pytest.mark.usefixtures("midday")
def test_a_session_is_begun_and_ended_by_hand(world: World, routes: list[str]) -> None:
    server, member = world.server, world.people["member"]
    path = f"{world.path}/sessions"
    begun = server.ask("POST", path, member).json()
    assert server.ask("POST", path, member).json()["id"] == begun["id"]
    assert (begun["running"], begun["ascents"]) == (True, 0)
    tick(world, member, routes[0])
    tick(world, member, routes[0], kind="try")
    payload = read(world, f"/sessions/{begun['id']}")
    assert (payload["tops"], payload["points"], payload["hardest"], len(payload["done"])) == (
        1,
        200,
        "6A",
        2,
    )
    assert payload["grades"] == [{"grade": "6A", "routes": 1}]
    ended = server.ask("POST", f"{path}/{begun['id']}/end", member)
    assert ended.json()["running"] is False
    assert server.ask("POST", f"{path}/{begun['id']}/end", member).status_code == 409
    tick(world, member, routes[1])
    assert len(read(world, "/sessions")) == 2
    with server.database.reading() as session:
        row = session.get_one(ClimbingSession, UUID(begun["id"]))
        assert len(ascents_of(session, row)) == 2


def test_another_time_zone_begins_other_days(world: World, routes: list[str]) -> None:
    member = world.people["member"]
    for hour in (2, 6):  # one day in UTC-12, two in UTC
        moment = datetime(2026, 3, 2, hour, tzinfo=UTC) - timedelta(minutes=hour == 6 and 60)
        tick(world, member, routes[0], climbed_at=moment.isoformat())
    assert len(read(world, "/sessions")) == 2
    changed = {"time_zone": "Etc/GMT+12"}
    assert world.server.ask("PATCH", world.path, world.owner, changed).is_success
    assert len(read(world, "/sessions")) == 2  # a whole gym is counted after the request
    do_all(world.server, Task(RECOUNTS, lambda gym: recount_gym(world.server.database, UUID(gym))))
    assert len(read(world, "/sessions")) == 1


def test_each_person_of_a_gym_is_counted_in_a_transaction_of_their_own(
    world: World, routes: list[str]
) -> None:
    people = [world.people[name] for name in ("member", "judge", "setter")]
    for person in people:
        tick(world, person, routes[0])
    with counted(world.server) as begun:
        assert recount_gym(world.server.database, world.gym.id) == len(people)
    assert len(begun) == 1 + len(people)  # the first one reads who there is
