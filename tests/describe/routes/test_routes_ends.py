"""Start and top of routes, and the reasons against them."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from walltopo.describe.routes import start_and_top as ends
from walltopo.describe.routes.start_and_top import (
    StartAndTop,
    WallStats,
    find_start_and_top,
    hand_probability,
    split_hands,
    wall_stats,
)
from walltopo.scans.holds import FLAT, Hold

RISES = (0.9, 1.3, 1.7, 2.1, 2.5, 2.9, 3.3, 3.7)


def hold(number: int, x: float, z: float, kind: str = "jug", size: float = 0.2) -> Hold:
    return Hold(
        number,
        "hold",
        type=kind,
        type_confidence=0.9,
        colour="red",
        position=(x, 0.0, z),
        size=size,
    )


def column(x: float, first: int, heights: tuple[float, ...] = RISES) -> list[Hold]:
    return [hold(first + k, x + 0.2 * (-1) ** k, z) for k, z in enumerate(heights)]


OTHERS = [column(3.0, 100), column(6.0, 200)]


def around(own: list[Hold]) -> WallStats:
    routes = [own, *OTHERS]
    return wall_stats(routes, [one for route in routes for one in route])


def ends_of(own: list[Hold]) -> StartAndTop:
    return find_start_and_top(own, around(own), {}, 1)


def test_a_plain_route_starts_on_two_holds_and_nothing_speaks_against_it() -> None:
    found = ends_of(column(0.0, 1))
    assert [one.id for one in found.start] == [1, 2]
    assert (found.top.id, found.feet) == (8, ())
    assert (found.start_confidence.reason, found.top_confidence.reason) == ("", "")


def test_small_footholds_are_for_feet_and_a_small_named_hand_hold_is_in_doubt() -> None:
    own = column(0.0, 1)
    feet = [hold(20, 0.1, 0.4, "foothold", 0.08), hold(21, 0.0, 2.0, "foothold", 0.09)]
    assert [one.id for one in ends_of([*own, *feet]).feet] == [20, 21]
    either = replace(hold(22, 0.3, 0.6, "pocket", 0.1), type_confidence=0.55)
    plain, found = ends_of(own).start_confidence, ends_of([*own, either]).start_confidence
    assert found.cues["feet"] > plain.cues["feet"]
    assert found.confidence < plain.confidence


def test_where_all_is_for_feet_all_counts_as_hands() -> None:
    own = [hold(k, 0.0, 0.5 * k, "foothold", 0.06) for k in (1, 2, 3)]
    hands, feet = split_hands(own, 0.2)
    assert (hands, feet) == (own, [])
    assert [one.id for one in ends_of(own).start] == [1, 2]


def test_one_start_hold_where_it_has_room_and_the_next_is_far() -> None:
    own = column(0.0, 1, (0.9, *RISES[2:]))
    found = ends_of(own)
    assert [one.id for one in found.start] == [1]
    assert found.start_confidence.cues["gap"] > 0
    narrow = [replace(own[0], size=0.12), *own[1:]]
    assert [one.id for one in ends_of(narrow).start] == [1, 2]


def test_a_route_that_lost_its_ends_is_flagged_for_its_height() -> None:
    found = ends_of(column(0.0, 1, RISES[2:-2]))
    assert found.start_confidence.reason == ends.START_REASONS["height"]
    assert found.top_confidence.reason == ends.TOP_REASONS["height"]


def test_a_start_hold_that_another_route_may_own_is_flagged() -> None:
    own = column(0.0, 1)
    found = find_start_and_top(own, around(own), {1: {1: 0.5, 2: 0.5}}, 1)
    assert found.start_confidence.reason == ends.START_REASONS["rival"]
    assert found.top_confidence.reason == ""


def test_what_was_left_out_near_an_end_speaks_against_it_unless_it_is_flat() -> None:
    own = column(0.0, 1)
    wall = around(own)
    missed = hold(50, 0.1, 0.6)
    plain = find_start_and_top(own, wall, {}, 1).start_confidence.confidence
    for stray, reason, less in (
        (missed, "few photos confirm it", True),
        (missed, FLAT, False),
        (replace(missed, colour="blue"), "few photos confirm it", False),
        (replace(missed, size=0.9), "few photos confirm it", False),
        (replace(missed, position=(0.1, 0.0, 2.6)), "few photos confirm it", False),
    ):
        beside = wall.with_strays([], [replace(stray, left_out=reason)])
        assert (find_start_and_top(own, beside, {}, 1).start_confidence.confidence < plain) == less
    assert (
        find_start_and_top(own, wall.with_strays([missed], []), {}, 1).start_confidence.confidence
        < plain
    )


heights = st.lists(st.floats(0, 5), min_size=1, max_size=12)
kinds = st.sampled_from(["jug", "crimp", "foothold", "unknown"])


@given(heights, st.data())
def test_any_group_of_holds_has_ends(tall: list[float], data: st.DataObject) -> None:
    own = [
        hold(k, data.draw(st.floats(-1, 1)), z, data.draw(kinds), data.draw(st.floats(0, 0.5)))
        for k, z in enumerate(tall, start=1)
    ]
    wall = around(own)
    found = find_start_and_top(own, wall, {}, 1)
    hands = {one.id for one in own} - {one.id for one in found.feet}
    assert {one.id for one in found.start} <= hands
    assert found.top.position[2] == max(one.position[2] for one in own if one.id in hands)
    for doubt in (found.start_confidence, found.top_confidence):
        assert 0 <= doubt.confidence <= 1
        assert all(cue >= 0 for cue in doubt.cues.values())
        assert bool(doubt.reason) == (doubt.confidence < ends.MIN_CONFIDENCE)
    likely = hand_probability(own, wall.usual)
    assert ((likely >= 0) & (likely <= 1)).all()


def test_a_wall_without_routes_has_no_usual_ones() -> None:
    alone = find_start_and_top([hold(1, 0, 1)], wall_stats([], [hold(1, 0, 1)]), {}, 1)
    assert [one.id for one in alone.start] == [alone.top.id] == [1]
