"""Train the network that finds two-coloured holds: `walltopo train two-colours`.

It learns from photos of generated gyms of all palettes, under much and little light and chalk, in
which half of the holds have two colours. Every sixth gym is held out to choose the probability from
which a hold counts as two-coloured.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.describe.classify.two_colours import probability
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate
from walltopo_lab.train.two_colours.net import answers, train, write_onnx
from walltopo_lab.train.two_colours.views import PartedViews, joined, parted_views, read_gym_views

PALETTES = ("vivid", "faded", "neutral", "vivid", "plain")
FINISHES = ("painted", "plywood", "textured")
NETS, EPOCHS = 2, 13
HELD_OUT = 6  # every sixth gym
# Share of one-coloured holds that may count as two-coloured where the threshold is chosen, and the
# shares of the second colour in the pixels of a hold that count as two-coloured there.
FALSE, VISIBLE = 0.006, (0.1, 0.9)


def recipe_of(seed: int) -> Recipe:
    """Return the recipe of a gym whose photos train the network."""
    rng = np.random.default_rng([seed, 77])
    gym = GymSettings(
        width=6.0,
        routes=10,
        two_coloured=0.5,
        colours=rng.choice(PALETTES),
        chalk=float(rng.uniform(0.2, 1)),
        wear=float(rng.uniform(0.2, 0.8)),
        light=float(rng.choice([0.4, 0.7, 1, 1.4])),
        warmth=float(rng.uniform(0, 0.7)),
        finish=rng.choice(FINISHES),
        facets=float(rng.uniform(0, 1)),
    )
    photos = PhotoSettings(
        photos=12,
        width=1024,
        height=768,
        measure_share=0.05,
        noise=float(rng.uniform(0.5, 2.5)),
        blur_px=float(rng.uniform(0.3, 1)),
    )
    return Recipe(gym, photos, seed=seed)


def make_views(folder: Path, first: int, count: int, progress: Progress) -> list[PartedViews]:
    """Return the views of the holds of `count` gyms from seed `first`, made where missing."""
    folder.mkdir(parents=True, exist_ok=True)
    progress.step("photographing gyms", count)
    views = []
    for seed in range(first, first + count):
        generate(folder / str(seed), recipe_of(seed))
        views.append(parted_views(read_gym_views(folder / str(seed))))
        progress.advance()
    return views


def threshold(views: PartedViews, odds: NDArray[np.float32]) -> tuple[float, float]:
    """Return the probability that at most `FALSE` of the one-coloured holds exceed, and the share
    of the two-coloured ones that do.

    Parameters
    ----------
    odds : (n,) log odds of two colours in each view.
    """
    holds = np.unique(views.hold)
    found = np.array([probability(odds[views.hold == hold]) for hold in holds])
    share = views.visible[holds]
    one = np.sort(found[share == 0])[::-1]
    certain = float(one[int(FALSE * len(one))])
    two = found[(share >= VISIBLE[0]) & (share <= VISIBLE[1])]
    return certain, float((two > certain).mean())


def fit_two_colours(
    path: Path, folder: Path, first: int, count: int, progress: Progress
) -> tuple[float, float]:
    """Make the photos, train, choose the threshold, and write the file.

    Parameters
    ----------
    path : ONNX file to write; folder : of the gyms, made where they are missing.
    first, count : seeds of the gyms.

    Returns
    -------
    The threshold, and the share of two-coloured holds that it finds on the gyms held out.
    """
    views = make_views(folder, first, count, progress)
    others = joined(views[::HELD_OUT])
    own = joined([one for k, one in enumerate(views) if k % HELD_OUT])
    progress.step("training")
    nets = [train(own, EPOCHS, seed, progress) for seed in range(NETS)]
    certain, recall = threshold(others, answers(nets, others.pictures))
    write_onnx(nets, path, {"certain": round(certain, 4)})
    return certain, recall
