"""Holds that turned or moved between two scans."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.describe.matching.inventory import changes
from walltopo.describe.matching.motions import Motion, find_motions
from walltopo.describe.matching.patches import INSIDE, TexturedWall, Window, patch_of
from walltopo.geometry.rays import Bvh
from walltopo.scans.holds import Hold

Floats = NDArray[np.float64]
_CELL = 0.0025  # metres, of the walls' grid
_PLACES = np.array([[0.4, 0.4], [1.0, 0.4], [0.4, 1.0], [1.0, 1.0]])


def wall_with(turns: list[float], shifts: Floats, unit: float = 1.0) -> TexturedWall:
    """A wall in the plane y = 0 with four wedges, of which each is turned and shifted.

    The climber looks along +y: x is to the right, z up; turns in degrees, counter-clockwise.
    """
    side = np.arange(0, 1.4, _CELL)
    x, z = np.meshgrid(side, side)
    height, labels = np.zeros(x.shape), np.zeros(x.shape, np.int32)
    colour = np.full((*x.shape, 3), 150.0)
    for number, (place, turn, shift) in enumerate(zip(_PLACES, turns, shifts, strict=True), 1):
        away = np.stack([x, z], axis=-1) - place - shift
        cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        u, v = away @ [cos, sin], away @ [-sin, cos]
        inside = (np.abs(u) < 0.09) & (np.abs(v) < 0.03 + 0.3 * (u + 0.09) * (u > 0))
        height[inside] = (0.03 + 0.2 * (v + 0.06))[inside]
        labels[inside] = number
        colour[inside] = [200, 40, 40]
    vertices = np.stack([x, -height, z], axis=-1).reshape(-1, 3) * unit
    n = len(side)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)[None]).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + n], axis=1)]
        + [np.stack([corner + 1, corner + n + 1, corner + n], axis=1)]
    ).astype(np.int32)
    grid = np.stack([x, side.max() - z], axis=-1).reshape(-1, 2) / side.max()
    mesh = Mesh(vertices, faces)
    texture = colour[::-1].astype(np.uint8)
    return TexturedWall(
        mesh,
        Bvh(mesh.vertices, mesh.faces),
        labels.ravel()[faces].max(axis=1),
        grid[faces].astype(np.float32),
        texture,
        unit,
    )


def holds_of(shifts: Floats, unit: float = 1.0) -> list[Hold]:
    places = np.column_stack([_PLACES + shifts, np.full(4, -0.02)])[:, [0, 2, 1]] * unit
    return [
        Hold(number, "hold", position=(x, y, z), normal=(0.0, -1.0, 0.0), size=0.2 * unit)
        for number, (x, y, z) in enumerate(places.tolist(), 1)
    ]


NONE = np.zeros((4, 2))


def test_a_patch_looks_straight_onto_the_hold() -> None:
    wall = wall_with([0.0, 0.0, 0.0, 0.0], NONE)
    patch = patch_of(wall, Window.around(holds_of(NONE)[0], 1.0), 1)
    assert patch[0, 0, INSIDE] == 0
    inside = patch[:, :, INSIDE] > 0
    assert 0.05 < inside.mean() < 0.3
    # The wedge is broader on its right, and red.
    rows, columns = np.nonzero(inside)
    assert np.ptp(rows[columns > 40]) > np.ptp(rows[columns < 24])
    assert np.median(patch[inside][:, 1]) > 0.1 > np.median(patch[~inside][:, 1])


@pytest.mark.parametrize("unit", [1.0, 3.0])
def test_turns_and_shifts_are_measured(unit: float) -> None:
    shifts = np.array([[0.0, 0.0], [0.0, 0.0], [0.03, -0.01], [0.0, 0.0]])
    old = wall_with([0.0, 20.0, 0.0, 0.0], NONE, unit)
    new = wall_with([0.0, 45.0, 0.0, -60.0], shifts, unit)
    before, after = holds_of(NONE, unit), holds_of(shifts, unit)
    motions = find_motions(old, new, before, after)
    assert set(motions) == {(k, k) for k in (1, 2, 3, 4)}
    assert motions[2, 2].turn == pytest.approx(25.0, abs=2.0)
    assert motions[4, 4].turn == pytest.approx(-60.0, abs=2.0)
    assert motions[3, 3].shift == pytest.approx((0.03, -0.01), abs=0.003)
    kinds = [one.what for one in changes(before, after, unit, motions)]
    assert kinds == ["stayed", "turned", "moved", "turned"]


def test_without_motions_a_turned_hold_stayed() -> None:
    holds = holds_of(NONE)
    assert [one.what for one in changes(holds, holds)] == ["stayed"] * 4


def test_a_motion_that_explains_little_counts_for_nothing() -> None:
    assert not Motion(30.0, (0.0, 0.0), error=2.0, still_error=2.1).is_turned
    assert not Motion(30.0, (0.0, 0.0), error=50.0, still_error=90.0).is_turned
    assert not Motion(2.0, (0.002, 0.0), error=0.5, still_error=2.0).is_moved
