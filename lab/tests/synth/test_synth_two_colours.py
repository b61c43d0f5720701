"""Holds of two colours: the share, the part that has the second one, and its shading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from walltopo_lab.synth import GymSettings
from walltopo_lab.synth.bodies import GymInstance
from walltopo_lab.synth.gym import Reset, set_up
from walltopo_lab.synth.mesh import merge_surface
from walltopo_lab.synth.shade import Finish, _hold_colour, noise_table
from walltopo_lab.synth.two_colours import _vertex_areas, second_faces

ONE = GymSettings(width=5.0, height=3.4, columns=4, routes=6, volumes=1, detail=0.4, downclimb=2)
TWO = replace(ONE, two_coloured=0.5)


@pytest.fixture(scope="module")
def holds() -> list[GymInstance]:
    return set_up(TWO, 4).holds


def test_the_given_share_of_holds_has_a_second_colour(holds: list[GymInstance]) -> None:
    painted = [hold for hold in holds if hold.second is not None]
    assert 0.3 < len(painted) / len(holds) < 0.7
    assert all(hold.second.name != hold.colour for hold in painted if hold.second)
    assert not any(hold.second for hold in holds if hold.role == "downclimb")
    pairs = {frozenset((hold.colour, hold.second.name)) for hold in painted if hold.second}
    assert not pairs & {frozenset(("red", "orange")), frozenset(("pink", "red"))}
    assert not any(hold.second for hold in set_up(ONE, 4).holds)


def test_the_second_colour_covers_its_share_of_the_hold(holds: list[GymInstance]) -> None:
    planes = 0
    surface = merge_surface([], holds, 0.05)
    second = second_faces(surface, holds)
    for hold in holds:
        if hold.second is None or hold.body is None:
            continue
        area = _vertex_areas(hold.body)
        if hold.second.plane is None:
            covered = float(hold.body.gloss @ area)
        else:
            planes += 1
            *way, level = hold.second.plane
            covered = float(area[hold.body.vertices @ np.array(way) > level].sum())
        own = surface.face_instance == hold.id
        assert (second & own).any() == (covered > 0)
        assert not (second & own).all()
        assert covered == pytest.approx(hold.second.share, abs=0.03)
        assert 0.22 < covered < 0.58
    assert planes > 3


def test_a_reset_keeps_the_colours_of_the_holds_that_stay() -> None:
    before = {hold.id: hold for hold in set_up(TWO, 4).holds}
    after = {hold.id: hold for hold in set_up(TWO, 4, Reset(9, "left")).holds}
    stayed = [n for n in before if n in after and before[n].route == after[n].route]
    assert len(stayed) > 10
    for number in stayed:
        assert before[number].second == after[number].second


@pytest.mark.parametrize(("on_slick", "slick"), [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
def test_a_point_has_the_colour_of_its_part(on_slick: float, slick: float) -> None:
    finish = Finish(
        rgb=np.array([[0.6, 0.1, 0.1]]),
        second=np.array([[0.1, 0.1, 0.6]]),
        plane=np.array([[0.0, 1.0, 0.0, 0.01 if on_slick == 0.0 else 9.0]]),
        on_slick=np.array([on_slick]),
        gloss=np.ones(1),
        grain=np.zeros(1),
        screws=np.full((1, 1, 2), 9.0),
        shifts=np.zeros(1),
        noise=noise_table() * 0,
        chalk=0.0,
    )
    for height in (0.005, 0.02):
        albedo = np.zeros(3)
        _hold_colour(finish, 0, np.array([0.0, height, 0.0]), np.array([0.0, slick, 0.0]), albedo)
        second = slick == 1.0 if on_slick else height > 0.01
        np.testing.assert_allclose(albedo, (finish.second if second else finish.rgb)[0])
