"""A climber is seen by whom they say, item by item."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import pytest
from gym.tests.worlds import Somebody, World, hold, make_world

from walltopo_gym.clock import now


def say(world: World, who: str, **words: Any) -> None:
    answer = world.server.ask("PUT", "/me/profile", world.people[who], words)
    assert answer.status_code == 200, answer.text


def seen(world: World, who: str, by: Somebody) -> Any:
    answer = world.server.ask("GET", f"/people/{world.people[who].id}", by)
    return answer.json() if answer.is_success else answer.status_code


@pytest.fixture
def ascent(world: World) -> str:
    """The member's."""
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    body = {
        "route_id": world.published()["routes"][0]["id"],
        "kind": "top",
        "tries": 1,
        "climbed_at": now().isoformat(),
        "note": "psst",
    }
    made = str(uuid4())
    path = f"{world.path}/ascents/{made}"
    assert world.server.ask("PUT", path, world.people["member"], body).is_success
    return made


def test_nothing_is_shown_until_one_says_so(world: World, ascent: str) -> None:
    member, judge = world.people["member"], world.people["judge"]
    assert world.server.ask("GET", "/me/profile", member).json()["on_boards"] is False
    facts = seen(world, "member", judge)
    assert (facts["name"], facts["ascents"], facts["pins"], facts["body"]) == ("member",) + (
        None,
    ) * 3
    say(world, "member", show_ascents="gym", show_body="followers", reach_cm=181, birth_year=1990)
    facts = seen(world, "member", judge)
    assert [row["route_name"] for row in facts["ascents"]] == ["Moon"]
    assert facts["ascents"][0]["wall_id"] == str(world.wall.id)
    assert "psst" not in str(facts)
    assert (facts["pins"], facts["body"]) == (None, None)
    assert "1990" not in str(facts)
    # To oneself all of it; to who has no gym in common, and to no one, one is not there.
    assert seen(world, "member", member)["body"] == {"height_cm": None, "reach_cm": 181}
    assert seen(world, "member", world.people["stranger"]) == 404
    say(world, "member", show_body="gym", reach_cm=181)
    assert seen(world, "member", judge)["body"]["reach_cm"] == 181
    assert seen(world, "member", judge)["ascents"] is None  # a change sets all fields


def test_gyms_that_are_not_shared_stay_hidden(world: World, ascent: str) -> None:
    """Both belong to another gym too; what was climbed here is not the other's to see."""
    other = make_world(world.server)
    assert world.server.ask("PUT", f"/me/pins/{ascent}", world.people["member"]).is_success
    say(world, "member", show_ascents="gym", show_pins="gym")
    join = f"{other.path}/join"
    with_invitation = world.server.ask("PATCH", other.path, other.owner, {"visibility": "public"})
    assert with_invitation.is_success
    assert world.server.ask("POST", join, world.people["member"]).is_success
    facts = seen(world, "member", other.people["judge"])
    assert ([gym["name"] for gym in facts["gyms"]], facts["ascents"], facts["pins"]) == (
        [other.gym.name],
        [],
        [],
    )
    assert len(seen(world, "member", world.people["judge"])["pins"]) == 1


def test_pins_are_ones_own_and_go_with_the_ascent(world: World, ascent: str) -> None:
    server, member = world.server, world.people["member"]
    path = f"/me/pins/{ascent}"
    assert server.ask("PUT", path, world.people["judge"]).status_code == 404
    assert [server.ask("PUT", path, member).status_code for _ in range(2)] == [204, 204]
    assert [row["id"] for row in seen(world, "member", member)["pins"]] == [ascent]
    assert server.ask("DELETE", f"/me/ascents/{ascent}", member).is_success
    assert seen(world, "member", member)["pins"] == []
    assert server.ask("PUT", path, member).status_code == 404


@pytest.mark.parametrize(
    "words", [{"show_ascents": "all"}, {"birth_year": 2500}, {"reach_cm": 3}, {"name": "x"}]
)
def test_what_cannot_be_is_refused(world: World, words: dict[str, Any]) -> None:
    assert world.server.ask("PUT", "/me/profile", world.people["member"], words).status_code == 422
