"""The simulation of many machines: list scheduling, first come first served."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo_lab.benchmarks.many_machines import waits

moments = st.lists(st.integers(0, 1000), min_size=1, max_size=30).map(sorted)


@given(moments, st.integers(1, 100))
def test_nobody_waits_where_there_is_a_place_for_each(come: list[int], seconds: int) -> None:
    assert waits(come, seconds, len(come)) == [0] * len(come)


@given(moments, st.integers(1, 100), st.integers(1, 5))
def test_no_more_run_at_a_time_than_there_are_places(
    come: list[int], seconds: int, places: int
) -> None:
    waited = waits(come, seconds, places)
    begun = [a + w for a, w in zip(come, waited, strict=True)]
    assert all(w >= 0 for w in waited)
    for moment in begun:
        assert sum(b <= moment < b + seconds for b in begun) <= places
    # Who waits begins at the moment when another ends.
    ends = {b + seconds for b in begun}
    assert all(b in ends for b, w in zip(begun, waited, strict=True) if w > 0)


@pytest.mark.parametrize(("places", "last"), [(1, 900), (2, 400), (10, 0)])
def test_all_at_once(places: int, last: int) -> None:
    assert max(waits([0] * 10, 100, places)) == last
