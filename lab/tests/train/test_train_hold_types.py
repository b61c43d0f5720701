"""The namer of hold types: the made-up holds that train it, and a short training."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walltopo.core import Silent
from walltopo.describe.classify.types import NONE_OF_THESE, open_model
from walltopo.scans.holds import UNKNOWN
from walltopo_lab.synth.holds import make_hold
from walltopo_lab.train.hold_types import scanned
from walltopo_lab.train.hold_types.fit import fit_hold_types

TYPES = ("jug", "crimp", "sloper", "pinch", "pocket", "foothold")
LARGEST = {"foothold": 0.13, "crimp": 0.45}  # metres; others up to a large sloper


@pytest.mark.parametrize("kind", TYPES)
def test_forms_are_whole_and_of_their_size(kind: str) -> None:
    rng = np.random.default_rng(4)
    for _ in range(12):
        heights, pixel = scanned.grammar_heights(kind, rng)
        there = heights > 0
        assert heights.shape == (scanned.GRID, scanned.GRID)
        assert np.isfinite(heights).all()
        assert there.mean() > 0.02
        # The grid's rim cuts nothing off but a tip.
        assert there[1:-1, 1:-1].sum() > 0.99 * there.sum()
        assert np.ptp(np.nonzero(there), axis=1).max() * pixel < LARGEST.get(kind, 0.75)


def test_a_foothold_is_smaller_than_a_sloper() -> None:
    rng = np.random.default_rng(5)
    median = {
        kind: np.median([(heights > 0).sum() * pixel**2 for heights, pixel in some])
        for kind in ("foothold", "sloper")
        for some in [[scanned.grammar_heights(kind, rng) for _ in range(12)]]
    }
    assert 8 * median["foothold"] < median["sloper"]


def test_a_body_is_drawn_as_high_and_as_large_as_it_is() -> None:
    body = make_hold("jug", "smooth", np.random.default_rng(1), 1.0, 0.8)
    ratios = []
    for seed in range(12):  # proportions vary around those of the body
        heights, pixel = scanned.frontal_heights(body, np.random.default_rng(seed), 10.0)
        across = np.ptp(np.nonzero(heights.any(axis=0))) * pixel
        ratios.append((heights.max() / body.vertices[:, 2].max(), across / (2 * body.radius)))
    np.testing.assert_allclose(np.median(ratios, axis=0), 1.0, atol=0.25)


def test_the_same_seed_scans_alike_and_another_does_not() -> None:
    heights, pixel = scanned.grammar_heights("jug", np.random.default_rng(2))
    first, same, other = (
        scanned.scanned_relief(heights, pixel, np.random.default_rng(k)) for k in (3, 3, 4)
    )
    assert first is not None
    assert same is not None
    assert other is not None
    np.testing.assert_array_equal(first.picture, same.picture)
    assert np.abs(first.picture - other.picture).mean() > 1e-3
    # Rough, but the same hold: as large and as high within a third.
    assert abs(first.scalars - other.scalars).max() < 0.33


def test_what_is_no_hold_of_one_type_is_there() -> None:
    rng = np.random.default_rng(6)
    things = [scanned.nothing_known(rng) for _ in range(20)]
    assert all(np.isfinite(heights).all() and pixel > 0 for heights, pixel in things)
    assert sum((heights > 0).any() for heights, _ in things) >= 15


@pytest.mark.slow
def test_a_short_training_gives_a_network_that_knows_what_it_knows(tmp_path: Path) -> None:
    path = tmp_path / "types.onnx"
    certain = fit_hold_types(path, [], Silent(), size=0.05)
    model = open_model(path)
    assert model.certain == certain
    assert model.names == (*TYPES, NONE_OF_THESE)
    relief = scanned.scanned_relief(
        *scanned.grammar_heights("jug", np.random.default_rng(0)), np.random.default_rng(1)
    )
    assert relief is not None
    ((name, sure),) = model.names_of([relief])
    assert 0 < sure <= 1
    assert name in (*TYPES, UNKNOWN)
    assert model.names_of([replace(relief, side_m=10 * model.sides[1])])[0][0] == UNKNOWN


def test_nothing_gives_no_relief() -> None:
    assert (
        scanned.scanned_relief(
            np.zeros((scanned.GRID, scanned.GRID)), 0.003, np.random.default_rng(0)
        )
        is None
    )
