"""The network of two-coloured holds: its views of generated holds, and a short training."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from walltopo.core import Silent
from walltopo.describe.classify.two_colours import CHANNELS, SIDE, open_model, probability
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate
from walltopo_lab.train.two_colours import fit
from walltopo_lab.train.two_colours.net import loss_of, varied
from walltopo_lab.train.two_colours.real import one_coloured, recoloured
from walltopo_lab.train.two_colours.views import (
    NONE,
    SOME,
    GymViews,
    PartedViews,
    joined,
    parted_views,
    read_gym_views,
)

SMALL = Recipe(
    GymSettings(
        width=3.0,
        height=2.6,
        columns=3,
        routes=3,
        volumes=1,
        downclimb=0,
        two_coloured=0.6,
        hold_scale=1.4,
        detail=0.4,
    ),
    PhotoSettings(photos=4, width=640, height=480, measure_share=0.0, distance_high=2.8),
    seed=3,
)


@pytest.fixture(scope="module")
def gym(tmp_path_factory: pytest.TempPathFactory) -> GymViews:
    folder = tmp_path_factory.mktemp("two") / "gym"
    generate(folder, SMALL)
    return read_gym_views(folder)


@pytest.fixture(scope="module")
def views(gym: GymViews) -> PartedViews:
    return parted_views(gym)


def test_views_show_the_parts_of_two_coloured_holds_alone(
    gym: GymViews, views: PartedViews
) -> None:
    names = sorted(gym.views)
    for number, name in enumerate(names):
        is_two = len(gym.truth.instances[name].colours) == 2
        own = views.hold == number
        assert is_two or (views.share[own] == 0).all()
        assert is_two or not views.parts[own].any()
        assert views.visible[number] == gym.visible_share(name)
    assert ((views.visible > 0.1) & (views.visible < 0.9)).sum() > 5
    assert views.pictures.shape[1:] == (CHANNELS, SIDE, SIDE)
    mixed = views.pictures[:, 3] * views.parts
    share = mixed.sum(axis=(1, 2)) / views.pictures[:, 3].sum(axis=(1, 2))
    np.testing.assert_allclose(share, views.share, atol=0.03)


def test_a_view_and_its_part_are_varied_alike(views: PartedViews) -> None:
    pictures, parts = torch.from_numpy(views.pictures[:6]), torch.from_numpy(views.parts[:6])
    for seed in range(4):
        other, turned = varied(pictures, parts, torch.Generator().manual_seed(seed))
        cover = other[:, 3]
        assert ((turned * cover).sum((1, 2)) - (parts * pictures[:, 3]).sum((1, 2))).abs().max() < 1
        # Hues are turned about grey, so that colourless places stay colourless.
        assert (other[:, :2].norm(dim=1)[cover == 0] == 0).all()


def test_either_part_may_be_called_the_first(views: PartedViews) -> None:
    rows = np.flatnonzero((views.share > SOME) & (views.share < 1 - SOME))[:8]
    pictures, parts = torch.from_numpy(views.pictures[rows]), torch.from_numpy(views.parts[rows])
    share = torch.from_numpy(views.share[rows].astype(np.float32))
    sure, odds = torch.full((len(rows),), 8.0), 16 * parts - 8
    loss = loss_of(sure, odds, pictures, parts, share)
    assert float(loss) < 0.2
    torch.testing.assert_close(loss_of(sure, -odds, pictures, parts, share), loss)
    assert float(loss_of(-sure, odds, pictures, parts, share)) > 5


def test_few_pixels_of_another_colour_count_for_nothing(views: PartedViews) -> None:
    pictures, parts = torch.from_numpy(views.pictures[:4]), torch.from_numpy(views.parts[:4])
    share = torch.full((4,), (NONE + SOME) / 2)
    assert float(loss_of(torch.full((4,), 8.0), 0 * parts, pictures, parts, share)) == 0.0


def test_the_threshold_keeps_one_coloured_holds_out() -> None:
    count = 400
    share = np.where(np.arange(count) % 4 == 0, 0.4, 0.0)
    noise = np.random.default_rng(1).normal(0, 1.5, count)
    odds = (np.where(share > 0, 4.0, -4.0) + noise).astype(np.float32)
    empty = np.zeros((count, 1), np.float32)
    views = PartedViews(np.arange(count), empty, empty, share, share)
    certain, recall = fit.threshold(views, odds, np.zeros(0, np.float32))
    found = np.array([probability(odds[[hold]]) for hold in range(count)]) > certain
    assert found[share == 0].mean() <= fit.FALSE
    assert recall == found[share > 0].mean() > 0.7


def test_the_threshold_keeps_holds_of_real_photos_out(views: PartedViews) -> None:
    odds = np.linspace(-3, 3, len(views.share)).astype(np.float32)
    real = np.random.default_rng(2).normal(4, 2, 500).astype(np.float32)
    certain, _ = fit.threshold(views, odds, real)
    found = np.array([probability(one[None]) for one in real]) > certain
    assert 0.5 * fit.FALSE_REAL <= found.mean() <= fit.FALSE_REAL


def test_a_hold_gets_the_paint_of_another_on_a_part(views: PartedViews) -> None:
    made = recoloured(views.pictures, np.random.default_rng(3))
    assert 0 < len(made.share) <= len(views.share)
    assert ((made.share > 0.08) & (made.share < 0.92)).all()
    cover = made.pictures[:, 3]
    for row, part in enumerate(made.parts):
        first, second = (
            np.average(made.pictures[row, :3].reshape(3, -1), axis=1, weights=weight.ravel() + 1e-6)
            for weight in (cover[row] * (1 - part), cover[row] * part)
        )
        assert np.linalg.norm(first - second) > 0.05
    assert (one_coloured(views.pictures).share == 0).all()


@pytest.mark.slow
def test_a_short_training_writes_a_network_that_opens(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit, "EPOCHS", 1)
    monkeypatch.setattr(fit, "NETS", 1)
    monkeypatch.setattr(fit, "recipe_of", lambda seed: replace(SMALL, seed=seed))
    out = tmp_path / "two.onnx"
    generate(tmp_path / "gyms" / "3", replace(SMALL, seed=3))
    photos = sorted((tmp_path / "gyms" / "3" / "photos").iterdir())
    certain, _ = fit.fit_two_colours(out, tmp_path / "gyms", 3, 2, photos, Silent())
    model = open_model(out)
    assert model.certain == pytest.approx(certain, abs=1e-4)
    odds, parts = model.answers(np.zeros((3, CHANNELS, SIDE, SIDE), np.float32))
    assert odds.shape == (3,)
    assert parts.shape == (3, SIDE, SIDE)


def test_gyms_are_joined_without_mixing_their_holds(views: PartedViews) -> None:
    both = joined([views, views])
    assert len(both.visible) == 2 * len(views.visible)
    second = both.hold[len(views.hold) :]
    assert (second == views.hold + len(views.visible)).all()
    np.testing.assert_array_equal(both.visible[second], views.visible[views.hold])
