"""Orders of moves are compared by what is left out, added or exchanged."""

from __future__ import annotations

import pytest

from walltopo_climb.beta.orders import order_difference


@pytest.mark.parametrize(
    ("first", "second", "share"),
    [
        ("", "", 0.0),
        ("abc", "", 1.0),
        ("abcd", "abcd", 0.0),
        ("abcd", "abxd", 0.25),
        ("abcd", "acd", 0.25),
        ("ab", "abcd", 0.5),
        ("kitten", "sitting", 3 / 7),
    ],
)
def test_the_difference_is_a_share_of_the_longer_order(
    first: str, second: str, share: float
) -> None:
    assert order_difference(first, second) == pytest.approx(share)
    assert order_difference(second, first) == pytest.approx(share)
