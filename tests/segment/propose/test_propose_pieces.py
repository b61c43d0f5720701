"""Bumps, what joins them with instances, and what the cues say of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.geometry.test_panels import folded, sheet

from walltopo.core import Mesh
from walltopo.segment.propose.evidence import (
    CUES,
    Masks,
    Tint,
    cues_of,
    is_explained,
    shipped_model,
)
from walltopo.segment.propose.pieces import Ground, find_bumps, merge_bumps
from walltopo.segment.propose.surroundings import Relief, Surroundings

AT = (0.6, 1.0)  # of the hold on the folded wall


def around(mesh: Mesh, radius: float) -> NDArray[np.bool_]:
    """Triangles near the hold."""
    return np.asarray(np.hypot(*(mesh.centroids[:, [0, 2]] - AT).T) < radius)


def test_the_hold_is_a_bump_unless_masks_are_sure_of_it() -> None:
    mesh = sheet(folded(cell=0.01), 0.01)
    ground = Ground.of(mesh, 1.0, True, 0)

    def bumps(sure: float) -> list[NDArray[np.int64]]:
        label = around(mesh, sure).astype(np.int32) * 7
        return find_bumps(mesh, ground.neighbours, ground.heights, ground.panels, label, 1.0)

    (rows,) = bumps(0.0)
    assert around(mesh, 0.09)[rows].all()
    assert np.isin(np.flatnonzero(around(mesh, 0.06)), rows).all()
    # A mask that is drawn too small leaves a rim, which is no hold of its own.
    assert not bumps(0.065)
    assert not bumps(0.09)
    label = np.zeros(len(mesh.faces), dtype=np.int32)
    label[rows] = 1
    relief = Surroundings(mesh, ground.heights, ground.panels, label, 1.0).relief(rows, 3)
    assert 0.045 < relief.height < 0.055
    assert relief.rim > 0.6
    assert 0.015 < relief.area < 0.06
    assert relief.on_wall == relief.around == 1.0


@given(st.lists(st.integers(0, 3), min_size=8, max_size=8), st.integers(0, 4), st.integers(5, 8))
def test_joining_takes_nothing_from_the_sure(label: list[int], first: int, last: int) -> None:
    before = np.array(label, dtype=np.int32)
    rows = np.arange(first, last)
    unsure = frozenset({2, 3})
    after, new, joined = merge_bumps(before, [rows], np.ones(8), unsure)
    assert (after[before == 1] == 1).all()
    assert len(new) + len(joined) <= 1
    for number, others in joined.items():
        assert {number, *others} <= unsure
        assert not np.isin(after, others).any()
    outside = np.setdiff1d(np.arange(8), rows)
    lost = {one for number, others in joined.items() for one in (number, *others)}
    assert all(after[k] == before[k] or before[k] in lost for k in outside)
    assert set(np.unique(after)) <= {0, 1, 2, 3} | new


HOLD = Relief(0.04, 0.8, 0.01, 0.15, 0.001, 1.0, 1.0, 6)


def test_each_cue_leans_to_its_side() -> None:
    model = shipped_model()

    def chance(relief: Relief, masks: Masks, tint: Tint) -> float:
        return float(model.probability(cues_of(relief, masks, tint)[None])[0])

    found = Masks(0.6, 0.9, 8)
    other = Tint(0.2, 0.9, 8)
    assert len(cues_of(HOLD, found, other)) == len(CUES)
    assert chance(HOLD, found, other) > 0.9
    assert chance(HOLD, Masks(), other) > chance(HOLD, Masks(), Tint(0.01, 0.2, 8))
    print_on_wall = Relief(0.001, 0.1, 0.01, 0.15, 0.001, 1.0, 1.0, 6)
    assert chance(print_on_wall, Masks(0.1, 0.4, 2), other) < 0.5


def test_what_no_photo_tells_of_is_not_explained() -> None:
    assert is_explained(HOLD, Masks(0.2, 0.5, 1), Tint())
    assert is_explained(HOLD, Masks(), Tint(0.1, 0.9, 3))
    assert not is_explained(HOLD, Masks(), Tint(0.1, 0.9, 1))
    assert not is_explained(HOLD, Masks(), Tint(0.01, 0.9, 9))
    assert not is_explained(replace(HOLD, area=0.0001), Masks(0.2, 0.5, 1), Tint(0.1, 0.9, 3))
