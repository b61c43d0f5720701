"""Holds of two colours: a network divides the pixels of a hold into two paints."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import shipped_file
from walltopo.describe.classify.colour import (
    HoldColour,
    HoldPaint,
    assign_colours,
    median_paint,
)
from walltopo.describe.classify.light import ERODE
from walltopo.describe.classify.observations import (
    MIN_PIXELS,
    HoldView,
    best_views,
    inner_mask,
    paint_of,
)
from walltopo.describe.classify.palette import Entry, name_of
from walltopo.images.colour import features, linear_from_srgb8
from walltopo.images.networks import Network, open_network
from walltopo.scans.holds import UNKNOWN
from walltopo.scans.pictures import SceneLight

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

SIDE = 32  # pixels of the network's picture
CHANNELS = 5  # paint (2), lightness, mask, size
VIEWS = 6  # best views of a hold that count
SMALLEST = 40  # visible pixels below which a view says nothing
BATCH = 128


@dataclass(frozen=True, eq=False)
class TwoPaints:
    """The two colours of a hold.

    Parameters
    ----------
    first, second : (n, 3) float64 linear RGB, one row for each view, under the scan's mean light.
    weights : (n,) weights of the views.
    share : of the second colour in the hold's visible pixels, at most a half.
    """

    first: Floats
    second: Floats
    weights: Floats
    share: float


def frame_view(view: HoldView, light: SceneLight) -> NDArray[np.float32]:
    """Return the network's (CHANNELS, SIDE, SIDE) float32 picture of one hold in one photo.

    The photo's gain is divided out, and the hold fills the square in its own proportions.
    """
    linear = linear_from_srgb8(view.crop) * light.factor(view.photo)
    square = square_of(features(linear, 1.0), view.mask)
    size = np.full((1, SIDE, SIDE), np.log(view.pixels / 400.0) / 2, dtype=np.float32)
    return np.concatenate([square, size])


_Slices = tuple[slice, slice]


def _square_around(mask: Bools) -> tuple[_Slices, int, _Slices]:
    """Return a mask's box, the side of the square around it, and the box in that square."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    height, width = int(rows[-1] - rows[0] + 1), int(columns[-1] - columns[0] + 1)
    side = max(height, width)
    top, left = (side - height) // 2, (side - width) // 2
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    return box, side, (slice(top, top + height), slice(left, left + width))


def square_of(values: Floats, mask: Bools) -> NDArray[np.float32]:
    """Return the means of a mask's values in the pixels of the square around it.

    Parameters
    ----------
    values : (h, w, k); those beside the mask do not count.

    Returns
    -------
    (k + 1, SIDE, SIDE) float32, 0 where the mask hardly reaches; the last layer is the share of
    each pixel that the mask covers.
    """
    box, side, inner = _square_around(mask)
    square = np.zeros((side, side, values.shape[2] + 1), dtype=np.float32)
    square[inner] = (np.dstack([values, np.ones(mask.shape)]) * mask[..., None])[box]
    how = cv2.INTER_AREA if side > SIDE else cv2.INTER_LINEAR
    small = np.asarray(cv2.resize(square, (SIDE, SIDE), interpolation=how), dtype=np.float32)
    small = np.moveaxis(small, -1, 0)
    cover = small[-1]
    means = np.divide(small[:-1], cover, out=np.zeros_like(small[:-1]), where=cover > 0.05)
    return np.concatenate([means, cover[None]])


def from_square(square: NDArray[np.float32], mask: Bools) -> NDArray[np.float32]:
    """Return the (h, w) values of a (SIDE, SIDE) layer at a mask's own pixels: see `square_of`."""
    box, side, inner = _square_around(mask)
    values = np.zeros(mask.shape, dtype=np.float32)
    values[box] = cv2.resize(square, (side, side), interpolation=cv2.INTER_LINEAR)[inner]
    return values


@dataclass(frozen=True, eq=False)
class TwoColourModel:
    """A loaded network that finds two-coloured holds.

    Parameters
    ----------
    network : the loaded file.
    certain : minimum probability, over all views, of a hold with two colours.
    """

    network: Network
    certain: float

    def answers(
        self, pictures: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return (n,) log odds of two colours and (n, SIDE, SIDE) share of one of them.

        Parameters
        ----------
        pictures : (n, CHANNELS, SIDE, SIDE), see `frame_view`.
        """
        odds, parts = [], []
        for first in range(0, len(pictures), BATCH):
            block = pictures[first : first + BATCH]
            two, part = self.network.session.run(None, {"views": block})
            odds.append(two)
            parts.append(part)
        return np.concatenate(odds), np.concatenate(parts)

    def two_paints(
        self, views: Mapping[int, Sequence[HoldView]], light: SceneLight
    ) -> dict[int, TwoPaints]:
        """Return the colours of the holds that have two.

        Parameters
        ----------
        views : hold id to its views; light : of the photos, with its `white`.
        """
        seen = [(hold, view) for hold, rows in views.items() for view in large_views(rows)]
        if not seen:
            return {}
        odds, parts = self.answers(np.stack([frame_view(view, light) for _, view in seen]))
        of_hold: dict[int, list[int]] = {}
        for row, (hold, _) in enumerate(seen):
            of_hold.setdefault(hold, []).append(row)
        found = {}
        for hold, rows in of_hold.items():
            if probability(odds[rows]) < self.certain:
                continue
            paints = [_two_of(seen[row][1], parts[row], light) for row in rows if odds[row] > 0]
            known = [one for one in paints if one is not None]
            if known:
                found[hold] = _colours_by_area(known)
        return found


def large_views(views: Sequence[HoldView]) -> list[HoldView]:
    """Return the views of a hold that count, best first."""
    return best_views([view for view in views if view.pixels >= SMALLEST], VIEWS)


def probability(odds: NDArray[np.float32]) -> float:
    """Return the probability of two colours from the log odds of a hold's views.

    The mean over the surer half of the views: from the other side only one colour may be visible.
    """
    best = np.sort(odds)[-((len(odds) + 1) // 2) :]
    return float(1 / (1 + np.exp(-best.mean())))


_Paints = tuple[Floats, Floats, float, float]  # linear RGB of both, share of the first, weight


def _two_of(view: HoldView, part: NDArray[np.float32], light: SceneLight) -> _Paints | None:
    """Return the paints of a view's two parts; None if one of them is too small to tell."""
    share = from_square(part, view.mask)
    one, two = view.mask & (share > 0.6), view.mask & (share < 0.4)
    if min(one.sum(), two.sum()) < MIN_PIXELS:
        return None
    gain = light.factor(view.photo)
    # The rim of a part is a mixture with the other part or with the wall.
    first, second = (paint_of(view.crop[inner_mask(mask, ERODE)])[0] * gain for mask in (one, two))
    return first, second, float(one.sum() / (one.sum() + two.sum())), view.quality


def _colours_by_area(paints: Sequence[_Paints]) -> TwoPaints:
    """Return the colours of all views, the larger one first.

    The network may call either part of a view the first, so each view is turned to agree with the
    best one.
    """
    reference = features(np.array(paints[0][:2]), 1.0)
    turned = []
    for one, two, share, weight in paints:
        own = features(np.array([one, two]), 1.0)
        straight = np.linalg.norm(own - reference, axis=1).sum()
        crossed = np.linalg.norm(own[::-1] - reference, axis=1).sum()
        turned.append(
            (one, two, share, weight) if straight <= crossed else (two, one, 1 - share, weight)
        )
    weights = np.array([row[3] for row in turned])
    one, two = (np.array([row[k] for row in turned]) for k in (0, 1))
    share = float(np.average([row[2] for row in turned], weights=weights))
    if share < 0.5:
        return TwoPaints(two, one, weights, share)
    return TwoPaints(one, two, weights, 1 - share)


def split_paints(
    paints: Mapping[int, HoldPaint],
    views: Mapping[int, Sequence[HoldView]],
    light: SceneLight,
    volumes: Collection[int],
) -> tuple[dict[int, HoldPaint], dict[int, HoldPaint]]:
    """Return the paint of each instance, and the second paint of the two-coloured holds.

    Parameters
    ----------
    paints : of all instances, as `paint_over_views` returns them; volumes : ids of those among
        them that are volumes, which have one colour.
    """
    holds = {number: rows for number, rows in views.items() if number not in volumes}
    found = shipped_model().two_paints(holds, light)
    first = {number: median_paint(two.first, two.weights) for number, two in found.items()}
    second = {number: median_paint(two.second, two.weights) for number, two in found.items()}
    return {**paints, **first}, second


def second_colours(
    second: Mapping[int, HoldPaint],
    colours: Mapping[int, HoldColour],
    palette: Sequence[Entry],
    *,
    spread: float,
    lightness_weight: float,
) -> dict[int, HoldColour]:
    """Return the second colour of each hold whose paints have two names.

    A paint far from every entry of the palette gets the nearest basic colour term.

    Parameters
    ----------
    second : hold id to its second paint; colours : to its first colour.
    palette, spread, lightness_weight : as in `assign_colours`.
    """
    scale = {"spread": spread, "lightness_weight": lightness_weight}
    named = {}
    for number, colour in assign_colours(second, palette, **scale).items():
        if colour.name == UNKNOWN:
            colour = replace(colour, name=name_of(colour.rgb, lightness_weight))
        if colour.name != colours[number].name:
            named[number] = colour
    return named


@cache
def shipped_model() -> TwoColourModel:
    """Return the network in `models/two_colours.onnx`."""
    return open_model(shipped_file("two_colours.onnx"))


def open_model(path: Path) -> TwoColourModel:
    """Return a network that `walltopo train two-colours` wrote.

    Raises
    ------
    InputError : the file does not exist, or is another kind of network.
    """
    network = open_network(path, threads=1)  # the network is too small to gain from threads
    if network.input_shape[1:] != (CHANNELS, SIDE, SIDE) or "certain" not in network.metadata:
        raise InputError(f"{path}: not a network of two-coloured holds")
    return TwoColourModel(network, network.number("certain", 1.0))
