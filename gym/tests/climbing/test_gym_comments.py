"""Comments in pages, reported, hidden; and who is banned takes part no more."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.worlds import Somebody, World, hold, make_world
from sqlalchemy import insert

from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.models import Opinion
from walltopo_gym.clock import now

HOSTILE = "<img src=x onerror=alert(1)> ونص 壁 \u0915"


@pytest.fixture
def route(world: World) -> str:
    """A route that hangs."""
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    found: str = world.published()["routes"][0]["id"]
    return found


def say(world: World, route: str, who: str, comment: str = HOSTILE) -> int:
    path = f"{world.path}/routes/{route}/opinion"
    return world.server.ask("PUT", path, world.people[who], {"comment": comment}).status_code


def read(world: World, route: str, by: str, query: str = "") -> Any:
    path = f"{world.path}/routes/{route}/comments{query}"
    return world.server.ask("GET", path, world.people[by]).json()


def of(world: World, route: str, who: str, what: str) -> str:
    return f"{world.path}/routes/{route}/comments/{world.people[who].id}/{what}"


def test_ten_thousand_comments_come_in_pages_each_once(world: World, route: str) -> None:
    """Two thousand here: pages are all the same."""
    count, start = 2000, now() - timedelta(days=1)
    people = [
        {
            "id": uuid4(),
            "email": f"{uuid4().hex}@example.com",
            "name": "x",
            "password_hash": "!",
            "operator": False,
            "created_at": start,
        }
        for _ in range(count)
    ]
    with world.server.database.writing() as session:
        session.execute(insert(Person), people)
        session.execute(
            insert(Opinion),
            [
                {
                    "route_id": UUID(route),
                    "person_id": row["id"],
                    "comment": "c",
                    "grade": "",
                    "wish": "",
                    "changed_at": start + timedelta(seconds=number // 3),
                }
                for number, row in enumerate(people)
            ],
        )
    seen, query = [], "?size=200"
    while query:
        page = read(world, route, "member", query)
        seen += [(row["changed_at"], row["person_id"]) for row in page["items"]]
        query = page["next"] and f"?size=200&cursor={page['next']}"
    assert len(set(seen)) == len(seen) == count
    assert [at for at, _ in seen] == sorted((at for at, _ in seen), reverse=True)


def test_what_is_written_comes_back_as_it_was(world: World, route: str) -> None:
    assert say(world, route, "member") == 204
    assert [row["comment"] for row in read(world, route, "judge")["items"]] == [HOSTILE]


def test_a_hidden_comment_is_its_authors_and_the_gyms(world: World, route: str) -> None:
    server = world.server
    assert say(world, route, "member", "Rude") == 204
    for reason in ("rude", "very rude"):  # two reports count once
        body = {"reason": reason}
        path = of(world, route, "member", "report")
        assert server.ask("PUT", path, world.people["judge"], body).status_code == 204
    assert say(world, route, "member", "Nothing happened") == 204
    reports = server.ask("GET", f"{world.path}/reports", world.people["setter"]).json()["items"]
    assert [(row["comment"], row["reason"]) for row in reports] == [("Rude", "very rude")]
    hidden = of(world, route, "member", "hidden")
    assert server.ask("PUT", hidden, world.people["setter"]).status_code == 204
    assert say(world, route, "member", "Rude again") == 204  # no way around it
    answer = {who: read(world, route, who)["items"] for who in ("judge", "member", "setter")}
    assert answer["judge"] == []
    assert [row["hidden"] for who in ("member", "setter") for row in answer[who]] == [True, True]
    left = server.ask("GET", f"{world.path}/reports", world.people["setter"]).json()
    assert left["items"] == []
    assert server.ask("DELETE", hidden, world.people["setter"]).status_code == 204
    assert len(read(world, route, "judge")["items"]) == 1


def test_a_report_can_be_dismissed_by_its_own_gym_alone(world: World, route: str) -> None:
    server, other = world.server, make_world(world.server)
    assert say(world, route, "member") == 204
    assert (
        server.ask(
            "PUT", of(world, route, "member", "report"), world.people["judge"], {}
        ).status_code
        == 204
    )
    path = f"{world.path}/reports"
    report = server.ask("GET", path, world.owner).json()["items"][0]["id"]
    theirs = f"{other.path}/reports/{report}"
    assert server.ask("DELETE", theirs, other.people["setter"]).status_code == 404
    assert server.ask("DELETE", f"{path}/{report}", world.owner).status_code == 204
    assert len(read(world, route, "setter")["items"]) == 1


def test_who_is_banned_takes_part_no_more_and_keeps_what_is_theirs(
    world: World, route: str
) -> None:
    server, member = world.server, world.people["member"]

    def tick(who: Somebody) -> Any:
        body = {"route_id": route, "kind": "top", "tries": 1, "climbed_at": now().isoformat()}
        return server.ask("PUT", f"{world.path}/ascents/{uuid4()}", who, body)

    assert server.ask("PATCH", world.path, world.owner, {"visibility": "public"}).is_success
    assert (tick(member).status_code, say(world, route, "member")) == (201, 204)
    path = f"{world.path}/bans/{member.id}"
    assert server.ask("PUT", path, world.owner, {"reason": "again"}).status_code == 204
    refused = tick(member)
    assert (refused.status_code, "banned" in refused.text) == (403, True)
    assert say(world, route, "member") == 403
    assert read(world, route, "judge")["items"] == []
    assert server.ask("POST", f"{world.path}/join", member).status_code == 403
    invited = server.ask("POST", f"{world.path}/invitations", world.owner, {}).json()["secret"]
    accepted = server.ask("POST", "/invitations/accept", member, {"secret": invited})
    assert accepted.status_code == 403
    data = server.ask("GET", "/me/data", member).json()
    assert (len(data["ascents"]), len(data["opinions"]), len(data["bans"])) == (1, 1, 1)
    # An owner is not banned by another, nor oneself.
    own = f"{world.path}/bans/{world.owner.id}"
    assert server.ask("PUT", own, world.owner, {}).status_code == 409
    assert server.ask("DELETE", path, world.owner).status_code == 204
    assert server.ask("POST", f"{world.path}/join", member).is_success
    assert len(read(world, route, "judge")["items"]) == 1
