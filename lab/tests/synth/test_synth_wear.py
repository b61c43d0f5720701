"""Gyms some weeks later: holds that turned, shifted or are gone."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo_lab.synth import GymSettings
from walltopo_lab.synth.bodies import GymInstance
from walltopo_lab.synth.gym import set_up
from walltopo_lab.synth.wear import Wear, wear_holds

SMALL = GymSettings(width=5.0, height=3.6, routes=6, volumes=2)


def worn(seed: int) -> tuple[dict[int, GymInstance], dict[int, GymInstance], Wear]:
    built = set_up(SMALL, 4)
    holds, wear = wear_holds(built.holds, built.facets, np.random.default_rng(seed))
    return {one.id: one for one in built.holds}, {one.id: one for one in holds}, wear


def test_each_kind_of_wear_occurs_and_most_holds_stay() -> None:
    before, after, wear = worn(1)
    touched = {*wear.turned, *wear.shifted, *wear.gone}
    assert wear.turned
    assert wear.shifted
    assert wear.gone
    assert len(touched) < len(before) / 2
    assert set(after) == set(before) - set(wear.gone)
    assert all(after[key] is before[key] for key in set(before) - touched)


@pytest.mark.parametrize("seed", range(3))
def test_a_turned_hold_turns_about_its_bolt_by_the_angle(seed: int) -> None:
    before, after, wear = worn(seed)
    for key, angle in wear.turned.items():
        old, new = before[key].placement, after[key].placement
        assert old is not None
        assert new is not None
        assert (old.origin == new.origin).all()
        relative = new.rotation @ old.rotation.T
        assert relative @ before[key].normal == pytest.approx(before[key].normal, abs=1e-9)
        turned = np.degrees(np.arccos((np.trace(relative) - 1) / 2))
        assert turned == pytest.approx(abs(angle))
        across = np.cross(old.rotation[:, 0], new.rotation[:, 0]) @ before[key].normal
        assert np.sign(across) == np.sign(angle)


@pytest.mark.parametrize("seed", range(3))
def test_a_shifted_hold_stays_on_the_wall_and_off_its_neighbours(seed: int) -> None:
    before, after, wear = worn(seed)
    for key, length in wear.shifted.items():
        old, new = before[key], after[key]
        away = new.position - old.position
        assert np.linalg.norm(away) == pytest.approx(length)
        assert away @ old.normal == pytest.approx(0.0, abs=1e-9)
        for other in before.values():
            if other.id != key:
                room = np.linalg.norm(other.position - new.position)
                touching = new.body.radius + other.body.radius  # type: ignore[union-attr]
                assert room >= min(touching, np.linalg.norm(other.position - old.position))


def test_the_truth_has_ids_as_text() -> None:
    record = Wear({3: 12.345}, {4: 0.01234}, (5,)).as_dict()
    assert record == {"turned_deg": {"3": 12.35}, "shifted_m": {"4": 0.0123}, "gone": [5]}
