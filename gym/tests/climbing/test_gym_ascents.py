"""Ascents arrive once and outlive what they were climbed on; opinions are counted."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any
from uuid import UUID, uuid4

import httpx
import pytest
from gym.tests.worlds import PASSWORD, Somebody, World, hold, make_world
from sqlalchemy import Uuid, func, select
from tests.at_once import at_once

from walltopo_gym.accounts.access import FOR
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.migrations.tables import METADATA
from walltopo_gym.publishing.models import Placement
from walltopo_gym.scans.models import Scan


@pytest.fixture
def route(world: World) -> str:
    """A route that hangs."""
    scan = world.reviewed({1: [1, 2]}, [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4)])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    found: str = world.published()["routes"][0]["id"]
    return found


def tick(
    world: World, ascent: UUID, route: str, who: str = "member", **words: Any
) -> httpx.Response:
    body = {"route_id": route, "kind": "top", "tries": 3, "climbed_at": now().isoformat()} | words
    path = f"{world.path}/ascents/{ascent}"
    return world.server.ask("PUT", path, world.people[who], body)


def own(world: World, who: Somebody | None = None, query: str = "") -> list[dict[str, Any]]:
    path = f"/me/ascents{query}"
    items: list[dict[str, Any]] = world.server.ask(
        "GET", path, who or world.people["member"]
    ).json()["items"]
    return items


def test_what_waited_is_nobody_elses(world: World, route: str) -> None:
    ascent = uuid4()
    body = {"route_id": route, "kind": "top", "tries": 1, "climbed_at": now().isoformat()}
    path = f"{world.path}/ascents/{ascent}"
    member, judge = world.people["member"], world.people["judge"]
    facts = world.server.ask("GET", "/me", member).json()["id"]
    headers = {FOR: facts}
    answer = world.server.ask("PUT", path, judge, body, headers)
    assert (answer.status_code, answer.json()["code"]) == (401, "waited-for-another")
    assert own(world, judge) == []
    assert world.server.ask("PUT", path, member, body, headers).status_code == 201
    assert (
        world.server.ask("DELETE", f"/me/ascents/{ascent}", judge, headers=headers).status_code
        == 401
    )
    assert [each["id"] for each in own(world)] == [str(ascent)]


def test_a_tick_that_is_sent_twice_arrives_once(world: World, route: str) -> None:
    ascent = uuid4()
    statuses = at_once(*4 * [lambda: tick(world, ascent, route).status_code])
    assert sorted(statuses) == [200, 200, 200, 201]
    assert [facts["id"] for facts in own(world)] == [str(ascent)]
    assert tick(world, ascent, route, tries=5).json()["tries"] == 5
    # Nobody else's, and not another route's.
    assert tick(world, ascent, route, who="judge").status_code == 409


def many(
    world: World, *climbs: dict[str, Any], who: str = "member", **words: Any
) -> httpx.Response:
    body = {"ascents": list(climbs)} | words
    return world.server.ask("PUT", f"{world.path}/ascents", world.people[who], body)


def climb(route: str, **words: Any) -> dict[str, Any]:
    facts = {"id": str(uuid4()), "route_id": route, "kind": "top", "climbed_at": now().isoformat()}
    return facts | words


def test_several_ascents_arrive_once_and_count(world: World, route: str) -> None:
    climbs = [climb(route), climb(route, kind="try", tries=4)]
    edit = {"device": str(uuid4()), "number": 1, "age_s": 0}
    for _ in range(2):
        answer = many(world, *climbs, climbs[0], edit=edit)
        assert answer.status_code == 200
        assert [row["tries"] for row in answer.json()] == [1, 4, 1]
    assert len(own(world)) == 2
    (session,) = world.server.ask("GET", f"{world.path}/sessions", world.people["member"]).json()
    assert (session["ascents"], session["tops"]) == (2, 1)
    # A late copy of the list changes nothing that was edited since.
    assert tick(world, UUID(climbs[0]["id"]), route, tries=7).status_code == 200
    assert many(world, *climbs, edit=edit).json()[0]["tries"] == 7


def test_of_several_ascents_all_or_none_arrive(world: World, route: str) -> None:
    late = (now() + timedelta(days=9)).isoformat()
    answer = many(world, climb(route), climb(route, climbed_at=late))
    assert (answer.status_code, answer.json()["code"]) == (422, "ascent-in-future")
    assert many(world, climb(route), climb(str(uuid4()))).status_code == 404
    assert many(world).status_code == 422
    assert own(world) == []


def test_what_was_taken_back_stays_so(world: World, route: str) -> None:
    ascent = uuid4()
    assert tick(world, ascent, route).status_code == 201
    path = f"/me/ascents/{ascent}"
    member = world.people["member"]
    assert [world.server.ask("DELETE", path, member).status_code for _ in range(2)] == [204, 204]
    assert tick(world, ascent, route).status_code == 200  # the copy from the basement
    assert own(world) == []


def test_ascents_outlive_reset_and_wall(world: World, route: str) -> None:
    ascent = uuid4()
    assert tick(world, ascent, route).status_code == 201
    assert own(world, query=f"?wall={world.wall.id}") != []
    setter = world.people["setter"]
    assert world.server.ask("POST", f"{world.path}/routes/{route}/strip", setter).is_success
    # The basement has no reception: it arrives after the route was stripped.
    assert tick(world, uuid4(), route).status_code == 201
    assert world.server.ask("DELETE", world.path, world.owner).status_code == 204
    kept = next(facts for facts in own(world) if facts["id"] == str(ascent))
    assert (kept["route_id"], kept["gym_id"]) == (None, None)
    assert (kept["route_name"], kept["gym_name"]) == ("Moon", world.gym.name)


def test_a_clock_of_another_time_zone_counts_as_now(world: World, route: str) -> None:
    ahead = (now() + timedelta(hours=14)).isoformat()
    facts = tick(world, uuid4(), route, climbed_at=ahead).json()
    assert datetime.fromisoformat(facts["climbed_at"]) <= now()


@pytest.mark.parametrize(
    ("days", "code"),
    [
        (300, "ascent-in-future"),
        (2, "ascent-in-future"),
        (-3, "ascent-too-early"),
        (-20_000, "ascent-too-early"),
    ],
)
def test_an_ascent_of_an_impossible_day_is_refused(
    world: World, route: str, days: int, code: str
) -> None:
    at = now() + timedelta(days=days)
    refused = tick(world, uuid4(), route, climbed_at=at.isoformat())
    assert (refused.status_code, refused.json()["code"]) == (422, code)
    assert str(at.date()) in refused.json()["title"]
    assert own(world) == []
    kept = uuid4()
    assert tick(world, kept, route).status_code == 201
    assert tick(world, kept, route, climbed_at=at.isoformat()).status_code == 422
    assert tick(
        world, uuid4(), route, climbed_at=(now() - timedelta(hours=20)).isoformat()
    ).is_success


def test_a_late_tick_of_a_route_that_lived_on_counts_from_its_first_version(
    world: World, route: str
) -> None:
    """It was set weeks ago; a new version and a new date of setting change nothing about that."""
    setter = world.people["setter"]
    with world.server.database.writing() as session:
        scan = session.scalar(select(Placement.scan_id).where(Placement.route_id == UUID(route)))
        session.get_one(Scan, scan).created_at = now() - timedelta(days=30)
    late = (now() - timedelta(days=20)).isoformat()
    again = world.reviewed({1: [1, 2]}, [hold(1, 0.0, 1.0), hold(2, 0.3, 1.4)])
    revision = world.published()["revision"]
    assert world.publish(again, {"number": 1, "route_id": route}, revision=revision).is_success
    changed = {"set_on": str(world.gym.today())}
    assert world.server.ask("PATCH", f"{world.path}/routes/{route}", setter, changed).is_success
    assert tick(world, uuid4(), route, climbed_at=late).status_code == 201
    before = (now() - timedelta(days=40)).isoformat()
    assert tick(world, uuid4(), route, climbed_at=before).json()["code"] == "ascent-too-early"


def test_a_setter_can_say_that_a_route_is_older(world: World, route: str) -> None:
    at = (now() - timedelta(days=90)).isoformat()
    ascent = uuid4()
    assert tick(world, ascent, route, climbed_at=at).status_code == 422
    older = {"set_on": str(world.gym.today() - timedelta(days=100))}
    path = f"{world.path}/routes/{route}"
    assert world.server.ask("PATCH", path, world.people["setter"], older).is_success
    assert tick(world, ascent, route, climbed_at=at).status_code == 201


def test_another_gyms_route_is_not_there(world: World, route: str) -> None:
    ours = make_world(world.server)
    assert tick(ours, uuid4(), route).status_code == 404


@pytest.mark.parametrize(
    "words", [{"kind": "flash"}, {"kind": "won"}, {"tries": 0}, {"climbed_at": "2026-03-01T19:30"}]
)
def test_what_cannot_be_is_refused(world: World, route: str, words: dict[str, Any]) -> None:
    assert tick(world, uuid4(), route, **words).status_code == 422
    with world.server.database.reading() as session:
        count = select(func.count()).where(Ascent.gym_id == world.gym.id)
        assert session.scalar(count) == 0


def test_opinions_are_counted_and_nobody_is_named(world: World, route: str) -> None:
    opinions = {
        "member": {"stars": 5, "wish": "keep", "comment": "Best of the hall"},
        "judge": {"stars": 2, "wish": "renew"},
        "setter": {"wish": "keep"},
    }
    path = f"{world.path}/routes/{route}/opinion"
    for who, words in opinions.items():
        assert world.server.ask("PUT", path, world.people[who], words).status_code == 204
    assert world.server.ask("PUT", path, world.people["judge"], {"stars": 4}).status_code == 204
    for who, kind in (("member", "flash"), ("judge", "try")):
        assert tick(world, uuid4(), route, who=who, kind=kind, tries=1).status_code == 201
    tallies = f"{world.path}/walls/{world.wall.id}/tallies"
    assert world.server.ask("GET", tallies, world.people["member"]).json() == [
        {
            "route_id": route,
            "ascents": {"flash": 1, "try": 1},
            "climbers": 1,
            "stars": 4.5,
            "crowd": "",
            "votes": 0,
            "grades": {},
            "wishes": {"keep": 2},
        }
    ]
    assert world.server.ask("GET", path, world.people["member"]).json()["stars"] == 5
    comments = world.server.ask("GET", path.replace("opinion", "comments"), world.people["judge"])
    assert [facts["comment"] for facts in comments.json()["items"]] == ["Best of the hall"]
    assert world.server.ask("DELETE", path, world.people["member"]).status_code == 204
    assert world.server.ask("GET", path, world.people["member"]).json()["stars"] is None


def test_a_persons_data_is_exported_whole_and_deleted(world: World, route: str) -> None:
    server, member = world.server, world.people["member"]
    assert tick(world, uuid4(), route).status_code == 201
    opinions = {"stars": 5, "comment": "Best of the hall"}
    path = f"{world.path}/routes/{route}/opinion"
    assert server.ask("PUT", path, member, opinions).status_code == 204
    facts = server.ask("GET", "/me/data", member)
    kept = facts.json()
    assert kept["account"]["email"] == member.email
    assert [row["route_name"] for row in kept["ascents"]] == ["Moon"]
    assert [row["comment"] for row in kept["opinions"]] == ["Best of the hall"]
    assert [row["role"] for row in kept["gyms"]] == ["member"]
    assert "argon2" not in facts.text
    wrong = server.ask("POST", "/me/delete", member, {"password": "not the password"})
    assert wrong.status_code == 403
    assert server.ask("POST", "/me/delete", member, {"password": PASSWORD}).status_code == 204
    assert server.ask("GET", "/me", member).status_code == 401
    with server.database.reading() as session:
        for table in METADATA.sorted_tables:  # nothing but the log knows the id
            for column in table.columns:
                if table.name != "audit" and isinstance(column.type, Uuid):
                    count = select(func.count()).where(column == member.id)
                    assert session.scalar(count) == 0, column
    # The last owner stays.
    alone = server.ask("POST", "/me/delete", world.owner, {"password": PASSWORD})
    assert (alone.status_code, world.gym.name in alone.text) == (409, True)


def test_the_table_of_ascents_is_no_program(world: World) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1, "name": "=1+2", "setter": "x"}).is_success
    assert tick(world, uuid4(), world.published()["routes"][0]["id"]).status_code == 201
    answer = world.server.ask("GET", "/me/ascents.csv", world.people["member"])
    assert answer.headers["content-type"].startswith("text/csv")
    lines = answer.text.splitlines()
    assert lines[0] == "\ufeffclimbed_at,gym_name,route_name,grade,kind,tries,note"
    assert ",'=1+2,," in lines[1]
    czech = {"accept-language": "cs-CZ,cs;q=0.9"}
    answer = world.server.ask("GET", "/me/ascents.csv", world.people["member"], headers=czech)
    assert ";'=1+2;;" in answer.text
