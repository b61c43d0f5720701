"""Training data and fit of the regressions for start and top holds."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo.describe.routes import start_and_top as ends
from walltopo.describe.routes import start_and_top as hands
from walltopo_lab.train.ends.fit import Regression, fit_ends, fit_hands, rows_of
from walltopo_lab.train.ends.seen import SeenGym, simulate_scan, true_gym

EASY = 3004  # a small gym of five routes


@pytest.fixture(scope="module")
def seen() -> SeenGym:
    return simulate_scan(EASY)


def test_a_simulated_scan_is_of_its_gym(seen: SeenGym) -> None:
    gym = true_gym(EASY)
    places = {hold.id: hold.position for hold in gym.holds}
    shown = {hold.id for hold in seen.holds}
    assert shown.isdisjoint(hold.id for hold in seen.left_out)
    for hold in seen.holds:
        if hold.id in places:
            assert np.linalg.norm(np.subtract(hold.position, places[hold.id])) < 0.1
    for true in seen.true.values():
        assert true.start <= true.holds
        assert len(true.start) in (1, 2)
    matched = [true for _, true in seen.matched() if true is not None]
    assert len({id(true) for true in matched}) == len(matched), "no true route is found twice"


def test_what_a_scan_says_of_its_routes_is_what_the_rule_says_anew(seen: SeenGym) -> None:
    rows = rows_of(seen)
    for (route, _), row in zip(seen.matched(), rows, strict=True):
        assert route.start == tuple(hold.id for hold in row.ends.start)
        assert route.doubtful_start == row.ends.start_confidence.reason
        assert route.doubtful_top == row.ends.top_confidence.reason


def test_fitting_names_the_cues_of_the_product(seen: SeenGym) -> None:
    rows = rows_of(seen)
    both = fit_ends(rows)
    assert both.start.weights.keys() == ends.START_WEIGHTS.keys() == ends.START_REASONS.keys()
    assert both.top.weights.keys() == ends.TOP_WEIGHTS.keys() == ends.TOP_REASONS.keys()
    assert max(both.start.weights.values()) <= 0
    assert len(fit_hands([seen]).weights) == len(hands.HAND_WEIGHTS)


def test_a_regression_finds_what_made_the_data() -> None:
    rng = np.random.default_rng(0)
    cues = rng.uniform(0, 1, (4000, 3))
    odds = 2 - 5 * cues[:, 0] + 1.5 * cues[:, 2]
    right = rng.random(4000) < 1 / (1 + np.exp(-odds))
    free = Regression.of("abc", cues, right, most=None)
    assert free.weights["a"] == pytest.approx(-5, abs=0.6)
    assert free.weights["c"] == pytest.approx(1.5, abs=0.5)
    assert Regression.of("abc", cues, right, most=0.0).weights["c"] == 0
