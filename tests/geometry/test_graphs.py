"""Parts and clusters of graphs."""

from __future__ import annotations

import networkit
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.geometry.graphs import components, louvain, renumber

Ints = NDArray[np.int64]


@st.composite
def graphs(draw: st.DrawFn) -> tuple[int, Ints, Ints]:
    """Number of vertices and edges, none twice."""
    count = draw(st.integers(1, 20))
    pairs = draw(st.sets(st.tuples(*[st.integers(0, count - 1)] * 2).filter(lambda p: p[0] < p[1])))
    first, second = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2).T
    return count, first, second


@given(graphs())
def test_parts_are_what_edges_link_and_no_more(graph: tuple[int, Ints, Ints]) -> None:
    count, first, second = graph
    part = components(count, first, second)
    # The plain way: spread the lowest number along edges until nothing changes.
    lowest = np.arange(count)
    for _ in range(count):
        for a, b in zip(first, second, strict=True):
            lowest[[a, b]] = min(lowest[a], lowest[b])
    np.testing.assert_array_equal(part, renumber(lowest))


@given(st.lists(st.integers(-5, 5)))
def test_new_numbers_start_at_0_in_the_order_of_first_members(values: list[int]) -> None:
    groups = np.array(values, dtype=np.int64)
    seen = list(dict.fromkeys(values))
    assert renumber(groups).tolist() == [seen.index(value) for value in values]


@settings(deadline=None)
@given(graphs(), st.floats(0.2, 3), st.integers(0, 9))
def test_clusters_hang_together_and_are_the_same_each_time(
    graph: tuple[int, Ints, Ints], resolution: float, seed: int
) -> None:
    count, first, second = graph
    weight = np.linspace(0.1, 1.0, len(first))
    found = louvain(count, first, second, weight, resolution, seed)
    np.testing.assert_array_equal(found, louvain(count, first, second, weight, resolution, seed))
    np.testing.assert_array_equal(found, renumber(found))
    within = found[first] == found[second]
    assert components(count, first[within], second[within]).max() == found.max()


@pytest.mark.parametrize("threads", [1, 3])
def test_the_number_of_threads_stays_as_the_caller_set_it(threads: int) -> None:
    before = networkit.getMaxNumberOfThreads()
    networkit.setNumberOfThreads(threads)
    try:
        louvain(3, np.array([0, 1]), np.array([1, 2]), np.ones(2), 1.0, 0)
        assert networkit.getMaxNumberOfThreads() == threads
    finally:
        networkit.setNumberOfThreads(before)
