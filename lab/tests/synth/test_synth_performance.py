"""A body that climbs, its exact contacts, and what a clip of it shows."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from walltopo_climb.beta.contacts import find_contacts
from walltopo_climb.beta.in_view import LIMBS, WallHolds
from walltopo_climb.movement.body import ADULT
from walltopo_climb.movement.grips import Grips, best_pull, foot_share
from walltopo_climb.movement.sequence import Climb, Sequence, find_sequence
from walltopo_lab.evaluate.contacts import ContactCounts, count_contacts, order_distance
from walltopo_lab.synth.performance import Performance, PoseErrors, TrueContact, film, perform


def ladder(rungs: int = 9) -> Climb:
    """Holds left and right in turn; the last is the top."""
    numbers = np.arange(rungs)
    position = np.stack([0.2 * (-1.0) ** numbers, 0 * numbers, 0.4 + 0.4 * numbers], axis=1)
    wall = np.tile([0.0, -1.0, 0.0], (rungs, 1))
    grips = Grips(
        position=position,
        wall=wall,
        pull=best_pull(wall, wall),
        hand=np.full(rungs, 0.9),
        outward=np.full(rungs, 0.2),
        foot=foot_share(np.zeros(rungs)),
    )
    return Climb(grips, (2, 3), (rungs - 1,))


def climbed(seed: int) -> tuple[Climb, Sequence, Performance]:
    climb = ladder()
    sequence = find_sequence(climb, ADULT)
    assert sequence is not None
    return climb, sequence, perform(climb, sequence, np.random.default_rng(seed))


def test_a_limb_lies_on_its_hold_for_as_long_as_its_contact_lasts() -> None:
    climb, sequence, performance = climbed(0)
    assert sequence.reached
    assert performance.topped is not None
    for one in performance.contacts:
        during = (performance.times > one.begin - 1e-6) & (performance.times < one.end - 0.11)
        gaps = performance.limbs[during, one.limb] - climb.grips.position[one.hold]
        assert np.linalg.norm(gaps, axis=1).max(initial=0.0) < 0.02
    for limb in range(LIMBS):
        own = [one for one in performance.contacts if one.limb == limb]
        assert all(a.end <= b.begin for a, b in itertools.pairwise(own))
    hands = [one.hold for one in performance.contacts if one.limb < 2]
    moved = [move.to for move in sequence.moves[1:] if move.limb and "hand" in move.limb]
    assert hands[2:] == moved


def test_a_foot_without_a_hold_hangs_below_the_hips_and_falls_with_the_body() -> None:
    _, _, performance = climbed(0)
    legs = np.linalg.norm(performance.limbs[:, 2:] - performance.hips[:, None], axis=2)
    assert legs.max() < 1.1 * ADULT.leg
    assert (performance.limbs[:, 2:, 2] > -1e-9).all()
    landed = performance.hips[-1, 2]
    assert landed < performance.hips[:, 2].max() - 1.0


@pytest.mark.parametrize("handheld", [False, True])
def test_contacts_are_found_in_a_clip_with_the_errors_of_a_network(handheld: bool) -> None:
    climb, _, _ = climbed(0)
    turns = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ring = 0.05 * np.stack([np.cos(turns), 0 * turns, np.sin(turns)], axis=1)
    surface = climb.grips.position[:, None] + ring
    holds = WallHolds(np.arange(len(surface)) + 1, surface, np.zeros(len(surface), bool))
    hands, feet, orders = ContactCounts(), ContactCounts(), []
    for seed in range(4):
        _, _, performance = climbed(seed)
        rng = np.random.default_rng(seed)
        eye = np.array([0.8, -4.5, 1.5])
        frames = film(performance, eye, rng, PoseErrors(), handheld=handheld)
        true = [
            TrueContact(one.limb, one.hold + 1, one.begin, one.end) for one in performance.contacts
        ]
        until = performance.times[-1] - 1.5  # on the mat hands hang beside the lowest holds
        found = [one for one in find_contacts(frames, holds) if one.begin < until]
        count_contacts(found, true, hands, feet)
        orders.append(order_distance([one for one in found if one.hold], true))
    assert hands.f1 > 0.75
    assert feet.f1 > 0.6
    assert np.mean(orders) < 0.35


def test_counts_take_each_true_contact_once() -> None:
    true = [TrueContact(0, 5, 1.0, 2.0), TrueContact(2, 5, 1.0, 2.0), TrueContact(0, 6, 2.5, 3.0)]
    found = [TrueContact(0, 5, 1.4, 2.0), TrueContact(0, 5, 1.2, 2.0), TrueContact(0, 6, 3.1, 4.0)]
    hands, feet = ContactCounts(), ContactCounts()
    count_contacts(found, true, hands, feet)
    assert (hands.right, hands.found, hands.true) == (1, 3, 2)
    assert (feet.right, feet.found, feet.true) == (0, 0, 1)
    assert order_distance(true, true) == 0
    assert order_distance([], true) == 1
