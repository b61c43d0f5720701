"""Start tags: which hold they mark, and what they make of groups of one colour."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from flat_wall import wall  # type: ignore[import-not-found]
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo.routes.contract import RoutesSettings
from walltopo.routes.stage import find_routes
from walltopo.routes.start_tags import cut_at_starts, tagged_holds
from walltopo.scans.attributes import Hold, Route, StartTag, read_tags


def column(x: float, first: int, colour: str = "red", count: int = 8) -> list[Hold]:
    """A route up the wall at x, its holds to the left and right of it in turn."""
    return [
        Hold(
            first + k,
            "hold",
            (x + 0.2 * (-1) ** k, 0.0, 0.8 + 0.4 * k),
            colour=colour,
            size_m=0.15,
        )
        for k in range(count)
    ]


def beside(hold: Hold, number: int, colour: str = "red") -> StartTag:
    """A tag 12 cm below a hold."""
    x, y, z = hold.position
    return StartTag(number, (x, y, z - 0.12), colour=colour)


def groups(routes: list[Route], key: str = "holds") -> list[tuple[int, ...]]:
    return [getattr(route, key) for route in routes]


def test_two_routes_of_one_colour_that_touch_are_cut_at_their_tags() -> None:
    left, right = column(2.0, 1), column(2.9, 21)
    holds = left + right
    routes, _ = find_routes(wall(), holds, RoutesSettings())
    assert len(routes) == 1
    tags = [beside(hold, k) for k, hold in enumerate((*left[:2], *right[:2]), start=1)]
    routes, _ = find_routes(wall(), holds, RoutesSettings(), tags=tags)
    assert groups(routes) == [tuple(range(1, 9)), tuple(range(21, 29))]
    assert groups(routes, "start") == [(1, 2), (21, 22)]
    assert groups(routes, "tags") == [(1, 2), (3, 4)]
    off, _ = find_routes(wall(), holds, RoutesSettings(start_tags=False), tags=tags)
    assert len(off) == 1
    assert off[0].tags == ()


def test_a_start_with_two_tags_is_not_cut() -> None:
    holds = column(2.0, 1)
    x, y, z = holds[0].position
    sides = [StartTag(1, (x - 0.15, y, z), colour="red"), StartTag(2, (x + 0.15, y, z))]
    for tags in (sides, [beside(holds[0], 1), beside(holds[1], 2)]):
        routes, _ = find_routes(wall(), holds, RoutesSettings(), tags=tags)
        assert groups(routes) == [tuple(range(1, 9))]
        assert routes[0].tags == (1, 2)
    routes, _ = find_routes(wall(), holds, RoutesSettings(), tags=sides)
    assert routes[0].start == (1,)


def test_a_hold_between_two_routes_is_ambiguous() -> None:
    left, right = column(2.0, 1), column(3.0, 21)
    between = Hold(99, "hold", (2.5, 0.0, 2.9), colour="red", size_m=0.15)
    tags = [beside(left[0], 1), beside(left[1], 2), beside(right[0], 3), beside(right[1], 4)]
    routes, _ = find_routes(wall(), [*left, *right, between], RoutesSettings(), tags=tags)
    owner = next(route for route in routes if 99 in route.holds)
    assert set(owner.ambiguous[99]) == {1, 2}
    assert sum(owner.ambiguous[99].values()) == pytest.approx(1)
    assert not any(hold in route.ambiguous for route in routes for hold in route.start)


def test_a_tag_marks_the_hold_of_its_colour_then_the_nearest_low_one() -> None:
    red = Hold(1, "hold", (1.0, 0.0, 1.0), colour="red", size_m=0.1)
    blue = Hold(2, "hold", (1.2, 0.0, 1.0), colour="blue", size_m=0.1)
    high = Hold(3, "hold", (1.0, 0.0, 3.0), colour="red", size_m=0.1)
    holds, group = [red, blue, high], np.array([0, 1, 0])
    near_red = (1.02, 0.0, 0.9)
    tags = [
        StartTag(1, near_red, colour="blue"),
        StartTag(2, near_red, colour=""),
        StartTag(3, near_red, colour="green"),
        StartTag(4, (1.0, 0.0, 2.9), colour="red"),  # beside the top of its route
        StartTag(5, (3.0, 0.0, 1.0), colour="red"),  # beside nothing
    ]
    assert tagged_holds(tags, holds, group, 1.0) == {1: 1, 2: 0, 3: 0}


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(0, 4), st.floats(0.3, 4), st.integers(0, 3)), min_size=1, max_size=30
    ),
    st.data(),
)
def test_groups_with_at_most_one_tagged_hold_stay(
    places: list[tuple[float, float, int]], data: st.DataObject
) -> None:
    holds = [Hold(k + 1, "hold", (x, 0.0, z), size_m=0.15) for k, (x, z, _) in enumerate(places)]
    group = np.unique([g for _, _, g in places], return_inverse=True)[1].astype(np.int64)
    tagged = [
        data.draw(st.sampled_from(np.flatnonzero(group == number).tolist()))
        for number in np.unique(group)
        if data.draw(st.booleans())
    ]
    cut = cut_at_starts(holds, group, tagged, 1.0)
    np.testing.assert_array_equal(cut.group, group)
    assert not cut.odds


@settings(max_examples=60, deadline=None)
@given(st.data(), st.integers(2, 5), st.integers(4, 20), st.floats(0.1, 20))
def test_a_cut_only_refines_and_tells_probabilities(
    data: st.DataObject, tags: int, count: int, unit: float
) -> None:
    """Whatever the tags: groups are subdivided, at tagged holds, in any unit."""
    rng = np.random.default_rng(data.draw(st.integers(0, 10_000)))
    places = rng.uniform((0, 0, 0.3), (4, 0.01, 4), (count, 3))
    group = (places[:, 0] > 2).astype(np.int64)
    tagged = rng.choice(count, min(tags, count), replace=False).tolist()

    def cut_of(scale: float) -> np.ndarray:
        holds = [
            Hold(k + 1, "hold", (p[0], p[1], p[2]), size_m=0.15 * scale)
            for k, p in enumerate((scale * places).tolist())
        ]
        cut = cut_at_starts(holds, group, tagged, scale)
        for shares in cut.odds.values():
            assert sum(shares.values()) == pytest.approx(1)
        return cut.group

    found = cut_of(1.0)
    for part in np.unique(found):
        assert len(np.unique(group[found == part])) == 1
    for whole in np.unique(group):
        parts = np.unique(found[group == whole])
        marked = {int(found[row]) for row in tagged if group[row] == whole}
        assert len(parts) == 1 or set(parts.tolist()) == marked
    np.testing.assert_array_equal(cut_of(unit), found)


def test_tags_are_read_back_and_broken_ones_are_told(tmp_path: Path) -> None:
    path = tmp_path / "attributes.json"
    tag = StartTag(1, (0.1, 0.2, 0.3), (0.0, -1.0, 0.0), 0.07, 0.04, "red", 0.8, ("a.jpg",))
    path.write_text(json.dumps({"instances": [], "tags": [tag.to_json()]}))
    assert read_tags(path) == [tag]
    path.write_text(json.dumps({"instances": []}))
    assert read_tags(path) == []
    path.write_text(json.dumps({"instances": [], "tags": [{"id": 1}]}))
    with pytest.raises(InputError, match="tag entry 0"):
        read_tags(path)


def test_a_setter_has_the_last_word() -> None:
    """Routes that tags cut apart can be merged; the tags go with their holds."""
    left, right = column(2.0, 1), column(2.9, 21)
    tags = [beside(hold, k) for k, hold in enumerate((*left[:2], *right[:2]), start=1)]
    edits = {"merge": [{"routes": [1, 2], "at": [list(left[3].position), list(right[3].position)]}]}
    routes, _ = find_routes(wall(), left + right, RoutesSettings(), tags=tags, edits=edits)
    assert [len(route.holds) for route in routes] == [16]
    assert routes[0].tags == (1, 2, 3, 4)
    assert routes[0].ambiguous == {}
