"""Flat marks on the wall are distinguished from holds that stand out of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.describe.classify.low_confidence import Rise, flat_instances, measure_rises

STEP = 0.01  # metres between the vertices of the test wall


def wall(
    height: float, noise: float, turn: float, bend: float = 0.0
) -> tuple[Mesh, NDArray[np.int32]]:
    """A 0.8 m wall, a round patch of 5 cm in its middle raised by `height`, label 1.

    Parameters
    ----------
    turn : radians about x; bend : slope of the wall on the right of x = 0.2.
    """
    line = np.arange(-0.4, 0.4 + STEP / 2, STEP)
    count = len(line)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    inside = np.hypot(x, y) < 0.05
    z = np.where(inside, height, 0.0) + bend * np.maximum(x - 0.2, 0)
    z = z + np.random.default_rng(0).normal(0, noise, len(z))
    first = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    quads = [(first, first + count, first + 1), (first + 1, first + count, first + count + 1)]
    faces = np.vstack([np.column_stack(quad) for quad in quads]).astype(np.int32)
    c, s = np.cos(turn), np.sin(turn)
    vertices = np.column_stack([x, y, z]) @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    return Mesh(vertices, faces), inside[faces].all(axis=1).astype(np.int32)


@settings(deadline=None, max_examples=25)
@given(st.floats(0, 0.03), st.floats(-3, 3), st.floats(0.2, 5))
def test_the_height_is_found_at_any_turn_and_scale(height: float, turn: float, unit: float) -> None:
    mesh, labels = wall(height, 0.0005, turn)
    grown = Mesh(mesh.vertices * unit, mesh.faces)
    rise = measure_rises(grown, labels, {1: "hold"}, unit)[1]
    assert rise.height / unit == pytest.approx(height, abs=0.0012)
    assert rise.noise / unit == pytest.approx(0.0005 / np.sqrt(3), rel=0.35)  # of centroids


def test_tape_is_flat_and_a_thin_hold_is_not() -> None:
    for height, flat in ((0.001, {1}), (0.009, set[int]())):
        mesh, labels = wall(height, 0.001, 0.3)
        rises = measure_rises(mesh, labels, {1: "hold"}, 1.0)
        assert flat_instances(rises, 1.0, 0.005) == flat


def test_another_panel_beside_it_does_not_lift_a_card() -> None:
    mesh, labels = wall(0.0, 0.0005, 0.0, bend=1.5)
    labels = np.roll(labels.reshape(2, -1, 80), 14, axis=1).ravel()  # beside the bend
    rises = measure_rises(mesh, labels, {1: "hold"}, 1.0)
    assert flat_instances(rises, 1.0, 0.005) == {1}


def test_a_rough_mesh_cannot_tell() -> None:
    assert flat_instances({1: Rise(0.001, 0.004), 2: Rise(0.001, 0.001)}, 1.0, 0.005) == {2}


def test_neighbouring_holds_are_no_wall() -> None:
    mesh, labels = wall(0.02, 0.0, 0.0)
    everything = np.where(labels == 1, 1, 2).astype(np.int32)
    assert measure_rises(mesh, everything, {1: "hold", 2: "hold"}, 1.0) == {}


def test_a_card_on_a_volume_is_flat() -> None:
    mesh, labels = wall(0.0, 0.0003, 0.0)
    on_volume = np.where(labels == 1, 1, 2).astype(np.int32)
    rises = measure_rises(mesh, on_volume, {1: "hold", 2: "volume"}, 1.0)
    assert flat_instances(rises, 1.0, 0.005) == {1}


def test_what_is_larger_than_a_mark_is_not_queried() -> None:
    mesh, labels = wall(0.0, 0.0003, 0.0)
    grown = Mesh(mesh.vertices * 20, mesh.faces)
    assert measure_rises(grown, labels, {1: "hold"}, 1.0) == {}
