"""Work in threads: results in the order of the items, few waiting, errors at their turn."""

from __future__ import annotations

import pytest

from walltopo.core.parallel import available_cores, map_ahead


def test_results_come_in_the_order_of_the_items() -> None:
    assert list(map_ahead(lambda k: k * k, range(50))) == [k * k for k in range(50)]
    assert list(map_ahead(str, [])) == []


def test_no_more_results_wait_than_there_are_cores() -> None:
    begun: list[int] = []
    stream = map_ahead(begun.append, range(100))
    next(stream)
    assert len(begun) <= available_cores() + 1


def test_an_error_is_raised_at_its_items_turn() -> None:
    def work(k: int) -> int:
        if k == 2:
            raise ValueError("bad photo")
        return k

    stream = map_ahead(work, range(9))
    assert [next(stream), next(stream)] == [0, 1]
    with pytest.raises(ValueError, match="bad photo"):
        next(stream)
