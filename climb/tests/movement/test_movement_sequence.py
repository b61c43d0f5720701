"""The movement model on climbs whose answer is plain."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ladders import ladder  # type: ignore[import-not-found]

from walltopo.core import InputError
from walltopo_climb.movement.body import ADULT, CHILD, Body
from walltopo_climb.movement.grips import Grips, best_pull, hand_quality
from walltopo_climb.movement.sequence import LIMBS, Climb, find_sequence


def test_climbing_goes_from_the_start_to_the_top_one_limb_at_a_time() -> None:
    climb = ladder()
    found = find_sequence(climb, ADULT)
    assert found is not None
    assert found.reached
    assert set(found.moves[0].limbs[:2]) <= set(climb.start)
    assert set(found.moves[-1].limbs[:2]) == set(climb.top)
    for before, move in zip(found.moves[:-1], found.moves[1:], strict=True):
        changed = [k for k in range(4) if before.limbs[k] != move.limbs[k]]
        assert [LIMBS[k] for k in changed] == [move.limb]
    assert found.moves[found.crux].effort == max(
        move.effort for move in found.moves[1:] if move.limb in LIMBS[:2]
    )


def test_climbing_hands_are_within_reach_of_the_hip() -> None:
    climb = ladder(rise=0.5)
    found = find_sequence(climb, ADULT)
    assert found is not None
    place = climb.grips.position
    for move in found.moves:
        if move.beyond == 0:
            for hand in move.limbs[:2]:
                away = np.linalg.norm(place[hand] - np.array(move.hip))
                assert away <= ADULT.arm + ADULT.torso + ADULT.shoulders / 2


@pytest.mark.parametrize("mirrored", [False, True])
def test_climbing_a_short_body_does_not_reach_what_a_tall_one_does(mirrored: bool) -> None:
    climb = ladder(rungs=6, rise=0.4)
    place = climb.grips.position.copy()
    place[-1, 2] += 1.0  # the top stands 1.4 m above the hold before
    if mirrored:
        place[:, 0] *= -1
    grips = Grips(**{**vars(climb.grips), "position": place})
    far = Climb(grips, climb.start, climb.top)
    tall, child = find_sequence(far, Body(1.95)), find_sequence(far, CHILD)
    assert tall is not None
    assert child is not None
    assert (tall.reached, child.reached) == (True, False)
    assert child.moves[-1].limbs[0] != 5


def test_climbing_steeper_and_worse_is_harder() -> None:
    def effort(**what: float) -> float:
        found = find_sequence(ladder(**what), ADULT)
        assert found is not None
        assert found.reached
        return sum(move.effort for move in found.moves)

    assert effort(steepness_deg=0.0) < effort(steepness_deg=25.0) < effort(steepness_deg=45.0)
    assert effort(quality=0.9) < effort(quality=0.5)


def test_climbing_a_hold_leaning_left_is_pulled_to_the_right() -> None:
    wall = np.array([[0.0, -1.0, 0.0]])
    left = np.array([[-0.6, -0.8, 0.0]])
    assert best_pull(wall, wall)[0] == pytest.approx([0, 0, -1])
    assert best_pull(left, wall)[0, 0] > 0.3


@given(st.floats(0, 0.5), st.floats(0, 0.5))
def test_climbing_a_larger_hold_is_never_worse(small: float, large: float) -> None:
    low, high = sorted((small, large))
    assert hand_quality("crimp", low) <= hand_quality("crimp", high) <= hand_quality("jug", high)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31), st.integers(4, 8))
def test_climbing_any_holds_give_a_way_or_none(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    climb = ladder(count)
    place = rng.uniform([-1, -0.2, 0.2], [1, 0.2, 3.5], (count, 3))
    grips = Grips(**{**vars(climb.grips), "position": place})
    start = min(2, count - 2)
    found = find_sequence(Climb(grips, (start,), (count - 1,)), ADULT)
    if found is not None:
        assert all(np.isfinite([*move.hip, move.effort]).all() for move in found.moves)
        assert found.reached == (set(found.moves[-1].limbs[:2]) == {count - 1})


@pytest.mark.parametrize(("height", "reach"), [(0.5, 0.0), (3.0, 0.0), (1.7, 3.0)])
def test_climbing_no_such_body(height: float, reach: float) -> None:
    with pytest.raises(InputError):
        Body(height, reach)


def test_climbing_without_top_is_no_climb() -> None:
    climb = ladder()
    with pytest.raises(InputError, match="top"):
        Climb(climb.grips, climb.start, ())
