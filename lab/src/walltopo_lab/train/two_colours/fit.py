"""Train the network that finds two-coloured holds: `walltopo train two-colours`.

It learns from photos of generated gyms of all palettes, under much and little light and chalk, in
which half of the holds have two colours, and from photos of real walls, whose holds have one colour
but for a percent; there a second one is painted on some. Every sixth gym and photo is held out to
choose the probability from which a hold counts as two-coloured.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.describe.classify.two_colours import probability
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate
from walltopo_lab.train.two_colours.net import answers, train, write_onnx
from walltopo_lab.train.two_colours.real import one_coloured, read_photo_views, recoloured
from walltopo_lab.train.two_colours.views import PartedViews, joined, parted_views, read_gym_views

PALETTES = ("vivid", "faded", "neutral", "vivid", "plain")
FINISHES = ("painted", "plywood", "textured")
NETS, EPOCHS = 2, 13
HELD_OUT = 6  # every sixth gym
# Share of one-coloured holds that may count as two-coloured where the threshold is chosen, and the
# shares of the second colour in the pixels of a hold that count as two-coloured there.
FALSE, VISIBLE = 0.006, (0.1, 0.9)
# The same share of holds in single real photos, of which about a percent have two colours indeed.
FALSE_REAL = 0.02
REPAINTED = 0.4  # share of the real holds that occur again with a second colour


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


def threshold(
    views: PartedViews, odds: NDArray[np.float32], real: NDArray[np.float32]
) -> tuple[float, float]:
    """Return the probability that at most `FALSE` of the one-coloured holds and `FALSE_REAL` of
    the real ones exceed, and the share of the two-coloured ones that do.

    Parameters
    ----------
    odds : (n,) log odds of two colours in each view; real : (m,) the same of single real photos.
    """
    holds = np.unique(views.hold)
    found = np.array([probability(odds[views.hold == hold]) for hold in holds])
    share = views.visible[holds]
    one = np.sort(found[share == 0])[::-1]
    certain = float(one[int(FALSE * len(one))])
    if len(real):
        limit = np.sort(real)[::-1][int(FALSE_REAL * len(real))]
        certain = max(certain, probability(limit[None]))
    two = found[(share >= VISIBLE[0]) & (share <= VISIBLE[1])]
    return certain, float((two > certain).mean())


def _with_real(
    own: PartedViews, photos: Sequence[Path], progress: Progress
) -> tuple[PartedViews, NDArray[np.float32]]:
    """Return the views with those of real photos, and the pictures of the photos held out."""
    pictures = read_photo_views(photos, progress)
    held_out = np.concatenate(pictures[::HELD_OUT])
    seen = np.concatenate([one for k, one in enumerate(pictures) if k % HELD_OUT])
    rng = np.random.default_rng(0)
    some = seen[rng.permutation(len(seen))[: round(REPAINTED * len(seen))]]
    return joined([own, one_coloured(seen), recoloured(some, rng)]), held_out


def fit_two_colours(
    path: Path,
    folder: Path,
    first: int,
    count: int,
    photos: Sequence[Path],
    progress: Progress,
) -> tuple[float, float]:
    """Make the photos, train, choose the threshold, and write the file.

    Parameters
    ----------
    path : ONNX file to write; folder : of the gyms, made where they are missing.
    first, count : seeds of the gyms.
    photos : of real walls; may be empty.

    Returns
    -------
    The threshold, and the share of two-coloured holds that it finds on the gyms held out.
    """
    views = make_views(folder, first, count, progress)
    others = joined(views[::HELD_OUT])
    own = joined([one for k, one in enumerate(views) if k % HELD_OUT])
    held_out = np.zeros((0, *own.pictures.shape[1:]), dtype=np.float32)
    if photos:
        own, held_out = _with_real(own, photos, progress)
    progress.step("training")
    nets = [train(own, EPOCHS, seed, progress) for seed in range(NETS)]
    real = answers(nets, held_out) if len(held_out) else np.zeros(0, dtype=np.float32)
    certain, recall = threshold(others, answers(nets, others.pictures), real)
    write_onnx(nets, path, {"certain": round(certain, 4)})
    return certain, recall
