"""A gym's own scale, from no grade to hundreds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo_climb.grades.calibrate import OWN_ERRORS, Gym, Known, calibrate, leave_one_out
from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.model import Errors, range_of

ERRORS = Errors(spread=1.5, bound=2.0, coverage=0.8)


def gym_of(count: int, shift: float, slope: float, seed: int = 0) -> Gym:
    rng = np.random.default_rng(seed)
    difficulties = rng.uniform(5, 14, count)
    grades = 9 + shift + slope * (difficulties - 9) + rng.normal(0, ERRORS.spread, count)
    return calibrate(
        [Known(float(p), float(g)) for p, g in zip(difficulties, grades, strict=True)], ERRORS
    )


def test_grades_without_any_the_board_stands() -> None:
    gym = gym_of(0, 0, 1)
    for difficulty in (5.0, 8.3, 14.0):
        assert gym.grade_at(difficulty)[0] == pytest.approx(difficulty)
    assert gym.grade_at(8.0)[1] > ERRORS.spread  # a gym that nobody knows may be off


def test_grades_of_a_soft_gym_are_learnt() -> None:
    few, many = gym_of(5, -2.5, 0.8), gym_of(400, -2.5, 0.8)
    true = 9 - 2.5 + 0.8 * (12 - 9)
    assert abs(many.grade_at(12.0)[0] - true) < 0.3
    assert abs(many.grade_at(12.0)[0] - true) < abs(12 - true)
    assert many.grade_at(12.0)[1] < few.grade_at(12.0)[1]


def test_ranges_hold_once_a_gym_has_graded_enough() -> None:
    gym = gym_of(200, 1.0, 1.2)
    rng = np.random.default_rng(1)
    difficulties = rng.uniform(5, 14, 2000)
    grades = np.round(10 + 1.2 * (difficulties - 9) + rng.normal(0, ERRORS.spread, 2000))
    ranges = [gym.range(float(p)) for p in difficulties]
    held = np.mean([one.low <= g <= one.high for one, g in zip(ranges, grades, strict=True)])
    assert 0.75 < held < 0.88


def test_grades_many_votes_weigh_more_than_one() -> None:
    one = calibrate([Known(9.0, 12.0, votes=1)], ERRORS).grade_at(9.0)[0]
    many = calibrate([Known(9.0, 12.0, votes=50)], ERRORS).grade_at(9.0)[0]
    assert 9 < one < many < 12


@pytest.mark.parametrize(
    ("difficulty", "bound"), [(-3.0, 1.0), (8.4, 0.1), (8.5, 2.0), (40.0, 1.0)]
)
def test_grades_ranges_lie_on_the_scale(difficulty: float, bound: float) -> None:
    low, high = range_of(difficulty, bound)
    assert 0 <= low <= high < len(FONT)


PLACES = st.floats(3, 16).map(lambda value: round(value, 2))
COUNTS = st.lists(
    st.builds(Known, PLACES, st.integers(0, 23).map(float), st.integers(0, 40), st.integers(0, 4)),
    max_size=40,
)


def plain_line(known: list[Known], centre: float) -> tuple[np.ndarray, np.ndarray]:
    """Prior and grades as rows of one least squares; mean and covariance of grade and slope."""
    rows, values = [[1 / 2.0, 0.0], [0.0, 1 / 0.3]], [centre / 2.0, 1 / 0.3]
    for one in known:
        variance = 0.7**2 if one.votes == 0 else 1.2**2 / one.votes
        spread = float(np.sqrt(ERRORS.spread**2 + variance + ((one.width + 1) ** 2 - 1) / 12))
        rows.append([1 / spread, (one.difficulty - centre) / spread])
        values.append(one.grade / spread)
    table = np.array(rows)
    return np.linalg.lstsq(table, np.array(values), rcond=None)[0], np.linalg.inv(table.T @ table)


@given(known=COUNTS, difficulty=PLACES)
def test_grades_a_gyms_line_is_plain_least_squares(known: list[Known], difficulty: float) -> None:
    gym = calibrate(known, ERRORS)
    line, covariance = plain_line(known, gym.centre)
    at = np.array([1.0, difficulty - gym.centre])
    middle, deviation = gym.grade_at(difficulty)
    assert middle == pytest.approx(at @ line, abs=1e-6)
    assert deviation**2 == pytest.approx(ERRORS.spread**2 + at @ covariance @ at, abs=1e-6)
    if len(known) < OWN_ERRORS:
        assert gym.widths == pytest.approx(ERRORS.bound / ERRORS.spread)
        return
    off = []
    for number, one in enumerate(known):
        rest, unsure = plain_line([*known[:number], *known[number + 1 :]], gym.centre)
        at = np.array([1.0, one.difficulty - gym.centre])
        off.append(abs(one.grade - at @ rest) / np.sqrt(ERRORS.spread**2 + at @ unsure @ at))
    share = np.mean(np.array(off) <= gym.widths + 1e-6)
    assert share >= ERRORS.coverage


@given(
    known=COUNTS,
    difficulty=PLACES,
    grade=st.integers(0, 23),
    votes=st.integers(1, 40),
    more=st.integers(1, 40),
    width=st.integers(1, 6),
)
def test_grades_more_and_surer_votes_pull_towards_them(
    known: list[Known], difficulty: float, grade: int, votes: int, more: int, width: int
) -> None:
    def middle(votes: int, width: int) -> float:
        one = Known(difficulty, float(grade), votes, width)
        return calibrate([*known, one], ERRORS).grade_at(difficulty)[0]

    off = [abs(grade - middle(*own)) for own in ((votes, width), (votes, 0), (votes + more, 0))]
    assert off[2] <= off[1] + 1e-9 <= off[0] + 2e-9


@given(known=COUNTS.filter(len))
def test_grades_a_range_by_the_others_does_not_lean_on_its_own(known: list[Known]) -> None:
    widths = calibrate(known, ERRORS).widths
    centre = calibrate(known, ERRORS).centre
    for number, found in enumerate(leave_one_out(known, ERRORS)):
        line, covariance = plain_line([*known[:number], *known[number + 1 :]], centre)
        at = np.array([1.0, known[number].difficulty - centre])
        middle, deviation = at @ line, np.sqrt(ERRORS.spread**2 + at @ covariance @ at)
        near = {range_of(middle, widths * deviation + nudge) for nudge in (-1e-6, 0, 1e-6)}
        assert (found.low, found.high) in near
        assert found.graded == len(known) - 1
