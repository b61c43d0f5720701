"""Holds of two colours: their slick part, or what lies beyond a plane, has a second colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Body, GymInstance, SecondColour
from walltopo_lab.synth.palette import PALETTES
from walltopo_lab.synth.params import GymSettings

Floats = NDArray[np.float64]

# Share of a hold's area in its second colour.
_SHARES = (0.25, 0.55)
# The slick part of a dual texture, if it is large enough, is often what has the second colour.
_ON_SLICK = 0.7
# Two-coloured holds are most often black or white beside their route's colour.
_BLACK_OR_WHITE = 0.5


def paint_second_colours(
    holds: Sequence[GymInstance], settings: GymSettings, seed: Sequence[int]
) -> list[GymInstance]:
    """Return the holds, a share `settings.two_coloured` of them with a second colour.

    The route's colour stays the hold's first colour. Downclimb jugs and volumes keep one colour.
    Each hold has its own random stream, so that holds that a reset leaves keep their colours.
    """
    painted = []
    for hold in holds:
        rng = np.random.default_rng([*seed, hold.id])
        if rng.random() < settings.two_coloured and hold.role != "downclimb":
            hold = replace(hold, second=_second_colour(hold, settings, rng))
        painted.append(hold)
    return painted


def _second_colour(
    hold: GymInstance, settings: GymSettings, rng: np.random.Generator
) -> SecondColour:
    """Return a random second colour of a hold, and the part of the hold that has it."""
    assert hold.body is not None
    palette = {k: v for k, v in PALETTES[settings.colours].items() if k != hold.colour}
    plain = [name for name in ("black", "white") if name in palette]
    names = plain if plain and rng.random() < _BLACK_OR_WHITE else list(palette)
    name = names[int(rng.integers(len(names)))]
    area = _vertex_areas(hold.body)
    slick = float(hold.body.gloss @ area)
    if _SHARES[0] <= slick <= _SHARES[1] and rng.random() < _ON_SLICK:
        return SecondColour(name, palette[name], None, slick)
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    heights = hold.body.vertices @ way
    order = np.argsort(heights)
    share = rng.uniform(*_SHARES)
    border = int(np.searchsorted(np.cumsum(area[order]), 1 - share))
    level = float(heights[order[min(border, len(order) - 1)]])
    plane = (float(way[0]), float(way[1]), float(way[2]), level)
    return SecondColour(name, palette[name], plane, share)


def _vertex_areas(body: Body) -> Floats:
    """Return the (V,) share of the body's area around each vertex."""
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    spread = np.bincount(body.faces.ravel(), np.repeat(area, 3), len(body.vertices))
    return spread / spread.sum()
