"""Overlapping photos are found among pieces of two pictures and a blank photo."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.reconstruct.ingest.overlap import find_overlap


def scene(seed: int) -> NDArray[np.uint8]:
    """Spots of all sizes, another pattern each time."""
    rng = np.random.default_rng(seed)
    across, down = np.meshgrid(np.arange(700), np.arange(300))
    grey = np.full((300, 700), 120.0)
    for x, y, size, tone in zip(
        rng.uniform(0, 700, 500),
        rng.uniform(0, 300, 500),
        rng.uniform(2, 12, 500),
        rng.uniform(-90, 90, 500),
        strict=True,
    ):
        near = np.abs(across - x) + np.abs(down - y) < size
        grey[near] = 120.0 + tone
    return grey.astype(np.uint8)


@pytest.fixture(scope="module")
def pieces() -> list[NDArray[np.uint8]]:
    """Three of one scene, one that shows nothing, two of another scene."""
    one, other = scene(1), scene(2)
    flat = np.full((300, 400), 128, np.uint8)
    return [one[:, :400], one[:, 150:550], one[:, 300:], flat, other[:, :400], other[:, 200:600]]


def test_what_overlaps_hangs_together(pieces: list[NDArray[np.uint8]]) -> None:
    found = find_overlap(pieces)
    assert found.is_whole
    assert found.groups == ((0, 1, 2), (4, 5), (3,))


def test_the_nearest_pictures_of_two_groups_have_a_gap_between_them() -> None:
    wall = scene(4)
    steps = [wall[:, x : x + 260] for x in (0, 120, 380, 440)]
    found = find_overlap(steps)
    assert found.groups == ((0, 1), (2, 3))
    assert found.gaps == ((2, 1),)


def test_of_strangers_the_next_in_the_sequence_are_named(
    pieces: list[NDArray[np.uint8]],
) -> None:
    groups_apart = [gap[0] for gap in find_overlap(pieces).gaps]
    assert groups_apart[1] == 3
    assert find_overlap([pieces[3], pieces[3]]).gaps == ((1, 0),)


def test_neighbours_are_enough_where_all_hang_together(pieces: list[NDArray[np.uint8]]) -> None:
    assert find_overlap(pieces[:3]).pairs == 2


def test_too_many_pairs_are_left_and_that_is_reported(pieces: list[NDArray[np.uint8]]) -> None:
    assert not find_overlap(pieces, max_pairs=4).is_whole


def test_no_pictures_have_no_parts() -> None:
    assert find_overlap([]).groups == ()


@pytest.mark.parametrize(("right", "up"), [(120, 0), (-120, 0), (0, 60), (40, -50)])
def test_the_view_moves_against_the_wall_in_the_picture(right: int, up: int) -> None:
    wall = scene(3)
    before, after = wall[60:240, 150:550], wall[60 - up : 240 - up, 150 + right : 550 + right]
    (shift,) = find_overlap([before, after]).shifts
    assert (shift.before, shift.after) == (0, 1)
    assert (shift.right, shift.up) == pytest.approx((right / 400, up / 180), abs=0.01)


def test_all_overlapping_neighbours_have_a_shift(pieces: list[NDArray[np.uint8]]) -> None:
    found = find_overlap(pieces)
    assert [(shift.before, shift.after) for shift in found.shifts] == [(0, 1), (1, 2), (4, 5)]
