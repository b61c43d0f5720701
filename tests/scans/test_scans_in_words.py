"""Walls in words."""

from __future__ import annotations

import pytest

from walltopo.scans.holds import Hold, count_words, steepness_words


@pytest.mark.parametrize(
    ("degrees", "words"),
    [
        (0.0, "vertical"),
        (5.4, "vertical"),
        (-5.4, "vertical"),
        (5.6, "6° overhang"),
        (-6.0, "6° slab"),
        (34.6, "35° overhang"),
    ],
)
def test_steepness(degrees: float, words: str) -> None:
    assert steepness_words(degrees) == words


def row(number: int, kind: str) -> Hold:
    return Hold(
        number, kind, "jug", "red", (200, 40, 40), (0, 0, 1), (0, -1, 0), 0.1, 0.01, 0, (), 1, None
    )


def test_a_volume_is_no_hold() -> None:
    holds = [row(1, "hold"), row(2, "volume"), row(3, "hold")]
    assert count_words(1, holds) == "1 route, 2 holds, 1 volume"
    assert count_words(0, holds[:1]) == "0 routes, 1 hold"
