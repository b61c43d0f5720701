"""Choose the palette settings on made-up gyms; nothing is reported on these.

    python -m walltopo_lab.benchmarks.colours_choose

A made-up gym has 1 to 12 of 14 paints, 3 to 39 holds each, seen under uneven light (log
deviation 0.18), with colour casts of hold (0.05) and gym (0.05), chalk (mean 8 %) and a veil.
Printed for each setting: share of holds in the right group (mean, worst) and of those that are
also called by the right name.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from walltopo.holds.colour import HoldPaint, assign_colours, find_palette
from walltopo.imaging.srgb import linear_from_srgb8

Floats = NDArray[np.float64]

# Two shades of each paint as holds are sold in them (our reading of manufacturers' charts).
PAINTS = {
    "black": ((30, 30, 32), (45, 45, 48)),
    "grey": ((115, 118, 120), (140, 140, 142)),
    "white": ((235, 235, 230), (220, 222, 220)),
    "red": ((190, 25, 35), (215, 45, 40)),
    "orange": ((240, 110, 20), (245, 140, 40)),
    "yellow": ((250, 205, 20), (235, 190, 40)),
    "green": ((30, 130, 60), (60, 160, 80)),
    "lime": ((140, 195, 45), (165, 210, 70)),
    "mint": ((60, 185, 165), (90, 200, 175)),
    "sky": ((90, 170, 220), (120, 190, 225)),
    "blue": ((25, 75, 175), (45, 100, 195)),
    "purple": ((100, 50, 150), (130, 75, 170)),
    "pink": ((225, 70, 140), (240, 110, 165)),
    "wood": ((205, 165, 115), (185, 140, 95)),
}


def seen_paint(base: Floats, rng: np.random.Generator, light: Floats) -> Floats:
    """(n, 3) linear colours of n holds of one paint (3,); `light` (n,) log brightness."""
    count = len(light)
    chalk = rng.beta(1.2, 12, (count, 1))
    cast = np.exp(rng.normal(0, 0.05, (count, 3)))
    veil = rng.uniform(0, 0.006, (count, 1))
    return (base * (1 - chalk) + 0.75 * chalk) * cast * np.exp(light)[:, None] + veil


def made_up_gym(seed: int) -> tuple[dict[int, HoldPaint], list[str]]:
    """Paints of the holds, and the name of each hold's paint."""
    rng = np.random.default_rng([31, seed])
    chosen = rng.choice(list(PAINTS), int(rng.integers(1, 13)), replace=False).tolist()
    cast = np.exp(rng.normal(0, 0.05, 3))
    colours, names = [], []
    for name in chosen:
        shade = PAINTS[name][int(rng.integers(2))]
        base = linear_from_srgb8(np.array(shade, dtype=np.uint8)) * cast
        count = int(rng.integers(3, 40))
        colours.append(seen_paint(base, rng, rng.normal(0, 0.18, count)))
        names += [name] * count
    linear = np.vstack(colours)
    # The wall tells how bright white is; not quite.
    linear *= np.exp(rng.normal(0, 0.1))
    return {k: HoldPaint(x, x[None], np.ones(1)) for k, x in enumerate(linear)}, names


def score(gym: tuple[dict[int, HoldPaint], list[str]], spread: float, weight: float) -> Floats:
    """Share of holds in the right group, and called by the right name."""
    paints, truth = gym
    palette = find_palette(paints, set(), spread=spread, lightness_weight=weight)
    found = assign_colours(paints, palette, spread=spread, lightness_weight=weight)
    called = [found[k].name for k in range(len(truth))]
    groups = sorted(set(called))
    table = np.zeros((len(set(truth)), len(groups)))
    for true, name in zip(truth, called, strict=True):
        table[sorted(set(truth)).index(true), groups.index(name)] += 1
    rows, columns = linear_sum_assignment(-table)
    named = np.mean([a == b for a, b in zip(truth, called, strict=True)])
    return np.array([table[rows, columns].sum() / len(truth), named])


def main() -> None:
    gyms = [made_up_gym(seed) for seed in range(60)]
    for spread, weight in itertools.product((0.10, 0.13, 0.16, 0.20), (0.35, 0.5, 0.7, 0.9)):
        values = np.array([score(gym, spread, weight) for gym in gyms])
        print(
            f"colour_spread {spread:.2f} lightness_weight {weight:.2f}: grouped "
            f"{values[:, 0].mean():.4f} (worst {values[:, 0].min():.3f}), named "
            f"{values[:, 1].mean():.4f}"
        )


if __name__ == "__main__":
    main()
