"""The members of a gym, in pages."""

from __future__ import annotations

from typing import Any

import pytest
from gym.tests.worlds import World

from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.roles import Role

pytestmark = pytest.mark.both_databases("search and paging in SQL")


def page(world: World, query: str = "") -> Any:
    answer = world.server.ask("GET", f"{world.path}/members{query}", world.owner)
    assert answer.status_code == 200, answer.text
    return answer.json()


def join(world: World, *names: str) -> None:
    people = world.server.persons(*names)
    with world.server.database.writing() as session:
        for person in people.values():
            assert person.id is not None
            add_member(session, world.gym.id, person.id, Role.MEMBER, person.id)


def test_each_member_is_on_one_page_also_while_others_join(world: World) -> None:
    join(world, *(f"climber {number}" for number in range(7)))
    before = page(world, "?size=200")
    assert before["next"] is None
    assert len(before["items"]) == 11  # and four with roles
    moments = [row["created_at"] for row in before["items"]]
    assert moments == sorted(moments, reverse=True)
    assert {row["role"] for row in before["items"]} == {"member", "judge", "setter", "owner"}
    found, cursor = [], ""
    for _ in range(4):
        one = page(world, f"?size=3&cursor={cursor}" if cursor else "?size=3")
        found += one["items"]
        cursor = one["next"]
        join(world, "late")
    assert cursor is None
    assert found == before["items"]


def test_pages_of_members_have_bounds(world: World) -> None:
    for query in ("?size=0", "?size=201", "?size=1_0", "?cursor=x"):
        path = f"{world.path}/members{query}"
        assert world.server.ask("GET", path, world.owner).status_code == 422
    join(world, *(f"climber {number}" for number in range(50)))
    assert len(page(world)["items"]) == 50
    assert len(page(world, f"?cursor={page(world)['next']}")["items"]) == 4
