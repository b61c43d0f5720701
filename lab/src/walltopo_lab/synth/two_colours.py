"""Holds of two colours: their slick part, or what lies beyond a plane, has a second colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.images.colour import features, linear_from_srgb
from walltopo_lab.synth.bodies import Body, GymInstance, SecondColour
from walltopo_lab.synth.mesh import Surface
from walltopo_lab.synth.palette import PALETTES, RGB
from walltopo_lab.synth.params import GymSettings

Floats = NDArray[np.float64]

# Share of a hold's surface in its second colour.
_SHARES = (0.25, 0.55)
# The slick part of a dual texture, if it is large enough, is often what has the second colour.
_ON_SLICK = 0.7
# Two-coloured holds are made to be seen: their paints differ at least by this, in `features`. Red
# and orange, or grey and white, differ by .2.
_MIN_CONTRAST, _LIGHTNESS_WEIGHT = 0.3, 0.6
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


def second_parts(holds: Sequence[GymInstance]) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the part in the second colour by instance id.

    Returns
    -------
    plane : (I, 4) as in `SecondColour`, 9 m away for holds without such a part.
    on_slick : (I,) whether the part is the slick one.
    """
    size = max((hold.id for hold in holds), default=0) + 1
    plane, on_slick = np.tile([0.0, 0.0, 0.0, 9.0], (size, 1)), np.zeros(size, np.bool_)
    for hold in holds:
        if hold.second is not None:
            on_slick[hold.id] = hold.second.plane is None
            plane[hold.id] = hold.second.plane or plane[hold.id]
    return plane, on_slick


def second_faces(surface: Surface, holds: Sequence[GymInstance]) -> NDArray[np.bool_]:
    """Return (F,) whether each triangle of a gym's surface is in its hold's second colour."""
    plane, on_slick = second_parts(holds)
    own = surface.own[surface.faces].mean(axis=1)
    slick = surface.marks[surface.faces, 1].mean(axis=1) > 0.5
    its = plane[surface.face_instance]
    beyond = np.einsum("fk,fk->f", own, its[:, :3]) > its[:, 3]
    return np.where(on_slick[surface.face_instance], slick, beyond)


def _second_colour(
    hold: GymInstance, settings: GymSettings, rng: np.random.Generator
) -> SecondColour | None:
    """Return a random second colour of a hold and its part; None if no colour stands out."""
    assert hold.body is not None
    palette = {
        name: rgb
        for name, rgb in PALETTES[settings.colours].items()
        if name != hold.colour and _paint_contrast(hold.rgb, rgb) >= _MIN_CONTRAST
    }
    if not palette:
        return None
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


def _paint_contrast(one: RGB, two: RGB) -> float:
    """Return the difference of two paints (sRGB, 0..1)."""
    first, second = features(linear_from_srgb(np.array([one, two])), _LIGHTNESS_WEIGHT)
    return float(np.linalg.norm(first - second))


def _vertex_areas(body: Body) -> Floats:
    """Return the (V,) share of each vertex in the body's area, without its back on the wall."""
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1)
    area[cross[:, 2] < -0.7 * area] = 0.0
    spread = np.bincount(body.faces.ravel(), np.repeat(area, 3), len(body.vertices))
    return spread / spread.sum()
