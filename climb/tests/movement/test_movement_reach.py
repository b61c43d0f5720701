"""The heights that reach the top of a ladder depend on its steps."""

from __future__ import annotations

import math

import pytest

from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.movement.reach import HEIGHTS, reached_by_arms, reaching_heights


def ladder(step: float, rungs: int = 6) -> tuple[Route, tuple[Hold, ...]]:
    """Jugs on a vertical wall, `step` metres apart."""
    holds = tuple(
        Hold(
            id=n, kind="hold", type="jug", size=0.12, position=(0.1 * (n % 2), 0.0, 0.5 + step * n)
        )
        for n in range(1, rungs + 1)
    )
    ids = tuple(hold.id for hold in holds)
    return Route(id=1, holds=ids, start=ids[1:2], top=ids[-1:]), holds


def test_everyone_climbs_a_ladder_and_nobody_a_bare_wall() -> None:
    assert tuple(reaching_heights(*ladder(0.35), 1.0) or ()) == HEIGHTS
    assert reaching_heights(*ladder(2.5), 1.0) == {}


@pytest.mark.parametrize("unit", [1.0, 3.0])
def test_long_steps_are_for_tall_climbers(unit: float) -> None:
    found = []
    for step in (0.35, 0.7, 0.9, 1.1, 1.3):
        route, holds = ladder(step * unit)
        found.append(reaching_heights(route, holds, unit) or ())
    shortest = [min(heights, default=9.0) for heights in found]
    assert shortest == sorted(shortest)
    assert shortest[0] < shortest[-1]


@pytest.mark.parametrize("unit", [1.0, 3.0])
def test_the_longest_reach_is_between_two_rungs_or_two_steps_apart(unit: float) -> None:
    route, holds = ladder(0.35 * unit)
    found = reaching_heights(route, holds, unit)
    assert found is not None
    rungs = [math.hypot(n % 2 * 0.1 / unit, 0.35 * n) for n in range(6)]
    for reach in found.values():
        assert min(abs(reach - rung) for rung in rungs) < 1e-6
    assert found[1.2] <= found[1.95]


def test_without_a_top_it_is_no_climb() -> None:
    route, holds = ladder(0.35)
    assert reaching_heights(Route(id=1, holds=route.holds, start=route.start), holds, 1.0) is None
    assert reached_by_arms(Route(id=1, holds=route.holds, start=route.start), holds, 1.0) is None


def test_arms_decide_between_the_heights_that_reach_and_those_that_do_not() -> None:
    worth = {"no": 0, "depends": 1, "yes": 2}
    for step in (0.35, 0.7, 0.8, 0.9, 1.0, 1.1, 2.5):
        route, holds = ladder(step)
        reached = reached_by_arms(route, holds, 1.0)
        usual = reaching_heights(route, holds, 1.0)
        assert reached is not None
        assert usual is not None
        ranks = [worth[one] for one in reached]
        assert ranks == sorted(ranks)
        for height, one in zip(HEIGHTS, reached, strict=True):
            assert one == "depends" or (height in usual) == (one == "yes")
    assert set(reached_by_arms(*ladder(0.35), 1.0) or ()) == {"yes"}
    assert set(reached_by_arms(*ladder(2.5), 1.0) or ()) == {"no"}


def test_at_some_height_it_depends() -> None:
    reached = reached_by_arms(*ladder(1.25), 1.0)
    assert reached is not None
    assert reached[0] == "depends"
    assert set(reached[1:]) == {"yes"}
