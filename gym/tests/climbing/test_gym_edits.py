"""A late copy of an edit never brings back an older state."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.climbing.test_gym_ascents import own, route, tick
from gym.tests.worlds import World
from hypothesis import given
from hypothesis import strategies as st

from walltopo_gym.climbing.edits import Edit, Edited, is_newer_edit
from walltopo_gym.clock import now

__all__ = ["route"]

PHONE, LAPTOP = uuid4(), uuid4()


class Row(Edited):
    """A row that is in no table."""

    def __init__(self) -> None:
        self.edited_at, self.edited_by, self.edits = None, None, {}


@given(st.lists(st.tuples(st.integers(1, 9), st.floats(0, 1e6)), min_size=1, max_size=30))
def test_of_one_device_the_last_number_wins(arrivals: list[tuple[int, float]]) -> None:
    """Whatever order, copies and clock."""
    row, expected = Row(), 0
    for number, age_s in arrivals:
        if is_newer_edit(row, Edit(PHONE, number, age_s)):
            expected = number
    assert expected == max(number for number, _ in arrivals)


@given(st.permutations([(PHONE, 1, 300.0), (LAPTOP, 1, 200.0), (PHONE, 2, 100.0)]), st.data())
def test_of_two_devices_the_last_made_wins(
    edits: list[tuple[UUID, int, float]], data: st.DataObject
) -> None:
    row, expected = Row(), ""
    copies = data.draw(st.lists(st.sampled_from(edits), max_size=6))
    for device, number, age_s in [*edits, *copies]:
        if is_newer_edit(row, Edit(device, number, age_s)):
            expected = f"{device} {number}"
    assert expected == f"{PHONE} 2"


def test_who_tells_nothing_of_the_edit_has_the_last_word() -> None:
    row = Row()
    assert is_newer_edit(row, Edit(PHONE, 5, 0))
    assert is_newer_edit(row, None)
    assert not is_newer_edit(row, Edit(PHONE, 5, 0))
    assert is_newer_edit(row, Edit(PHONE, 6, 0))


def test_a_server_whose_clock_was_set_back_hears_others() -> None:
    row = Row()
    assert is_newer_edit(row, Edit(PHONE, 1, 0))
    row.edited_at = now() + timedelta(hours=3)
    assert is_newer_edit(row, Edit(LAPTOP, 1, 0))


def test_many_devices_are_no_burden() -> None:
    row = Row()
    for _ in range(50):
        assert is_newer_edit(row, Edit(uuid4(), 1, 0))
    assert len(row.edits) == 8


def edit(number: int) -> dict[str, Any]:
    return {"device": str(PHONE), "number": number, "age_s": 5}


def test_a_late_copy_of_a_tick_changes_nothing(world: World, route: str) -> None:
    ascent = uuid4()
    assert tick(world, ascent, route, kind="try", tries=1, edit=edit(1)).status_code == 201
    assert tick(world, ascent, route, tries=4, edit=edit(2)).status_code == 200
    late = tick(world, ascent, route, kind="try", tries=1, edit=edit(1))
    assert (late.status_code, late.json()["tries"]) == (200, 4)
    assert [(answer["kind"], answer["tries"]) for answer in own(world)] == [("top", 4)]


def test_a_late_copy_of_an_opinion_changes_nothing(world: World, route: str) -> None:
    path, member = f"{world.path}/routes/{route}/opinion", world.people["member"]
    for number, stars in ((1, 2), (2, 5), (1, 2)):
        body = {"stars": stars, "edit": edit(number)}
        assert world.server.ask("PUT", path, member, body).status_code == 204
    assert world.server.ask("GET", path, member).json()["stars"] == 5


@pytest.mark.parametrize("words", [{"number": 0}, {"number": 2**60}, {"age_s": -1}, {"x": 1}])
def test_an_odd_edit_is_refused(world: World, route: str, words: dict[str, Any]) -> None:
    assert tick(world, uuid4(), route, edit=edit(1) | words).status_code == 422
