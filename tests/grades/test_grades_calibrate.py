"""A gym's own scale, from no grade to hundreds."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo.grades.calibrate import Gym, Known, calibrate
from walltopo.grades.font import FONT
from walltopo.grades.model import Errors, range_of

ERRORS = Errors(spread=1.5, bound=2.0, coverage=0.8)


def gym_of(count: int, shift: float, slope: float, seed: int = 0) -> Gym:
    rng = np.random.default_rng(seed)
    places = rng.uniform(5, 14, count)
    grades = 9 + shift + slope * (places - 9) + rng.normal(0, ERRORS.spread, count)
    return calibrate(
        [Known(float(p), float(g)) for p, g in zip(places, grades, strict=True)], ERRORS
    )


def test_grades_without_any_the_board_stands() -> None:
    gym = gym_of(0, 0, 1)
    for place in (5.0, 8.3, 14.0):
        assert gym.place(place)[0] == pytest.approx(place)
    assert gym.place(8.0)[1] > ERRORS.spread  # a gym that nobody knows may be off


def test_grades_of_a_soft_gym_are_learnt() -> None:
    few, many = gym_of(5, -2.5, 0.8), gym_of(400, -2.5, 0.8)
    true = 9 - 2.5 + 0.8 * (12 - 9)
    assert abs(many.place(12.0)[0] - true) < 0.3
    assert abs(many.place(12.0)[0] - true) < abs(12 - true)
    assert many.place(12.0)[1] < few.place(12.0)[1]


def test_grades_ranges_hold_what_they_say_once_a_gym_has_told_enough() -> None:
    gym = gym_of(200, 1.0, 1.2)
    rng = np.random.default_rng(1)
    places = rng.uniform(5, 14, 2000)
    grades = np.round(10 + 1.2 * (places - 9) + rng.normal(0, ERRORS.spread, 2000))
    ranges = [gym.range(float(p)) for p in places]
    held = np.mean([one.low <= g <= one.high for one, g in zip(ranges, grades, strict=True)])
    assert 0.75 < held < 0.88


def test_grades_many_votes_weigh_more_than_one() -> None:
    one = calibrate([Known(9.0, 12.0, votes=1)], ERRORS).place(9.0)[0]
    many = calibrate([Known(9.0, 12.0, votes=50)], ERRORS).place(9.0)[0]
    assert 9 < one < many < 12


@pytest.mark.parametrize(("place", "bound"), [(-3.0, 1.0), (8.4, 0.1), (8.5, 2.0), (40.0, 1.0)])
def test_grades_ranges_lie_on_the_scale(place: float, bound: float) -> None:
    low, high = range_of(place, bound)
    assert 0 <= low <= high < len(FONT)
