"""White, grey and black of single holds, decided together with the holds around them.

Chalk, wear and shade change the lightness of a hold by about as much as grey differs from white or
black. Neighbours mostly belong to one route, so that their names decide where lightness cannot.

Source: the mean field of a Potts model with Gaussian weights, as in P. Krähenbühl, V. Koltun,
"Efficient Inference in Fully Connected CRFs with Gaussian Edge Potentials", NIPS 2011. The
constants were chosen on generated gyms (docs/colours.md).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from walltopo.describe.classify.colour import (
    HoldColour,
    HoldPaint,
    assign_colours,
    find_palette,
)
from walltopo.describe.classify.palette import Entry
from walltopo.images.colour import linear_from_srgb8, oklab_from_linear

Floats = NDArray[np.float64]

ACHROMATIC = ("white", "grey", "black")
SPREAD = 0.12  # standard deviation of a paint's lightness over the holds of a gym (OKLab)
REACH = 0.5  # metres: standard deviation of the weight of a neighbour over its distance
WEIGHT = 0.5  # of a neighbour that touches
# Routes go up: a distance along the wall counts more than one in height.
ACROSS, UPWARD = 1.6, 0.7
ROUNDS = 10
_IMPOSSIBLE = -50.0


def found_colours(
    paints: Mapping[int, HoldPaint],
    places: Mapping[int, Floats],
    volumes: Collection[int],
    uncertain: Collection[int] = (),
    second: Mapping[int, HoldPaint] | None = None,
    /,
    *,
    upright: bool,
    spread: float,
    lightness_weight: float,
) -> tuple[list[Entry], dict[int, HoldColour]]:
    """Return the palette that a scan's own holds give, and the colour of each instance.

    Parameters
    ----------
    places : (3,) position of each instance, metres; upright : whether z is up.
    volumes : ids of the instances that are volumes.
    uncertain : ids of the instances that are left out of the palette.
    second : second paints of two-coloured holds, by id.
    spread, lightness_weight : see `ClassifySettings`.
    """
    scale = {"spread": spread, "lightness_weight": lightness_weight}
    confident = {number: one for number, one in paints.items() if number not in uncertain}
    others = [one for number, one in (second or {}).items() if number not in uncertain]
    entries = find_palette(confident, volumes, others, **scale)
    colours = assign_colours(paints, entries, **scale)
    holds = {number: one for number, one in colours.items() if number not in volumes}
    colours |= settle_achromatic(holds, places, upright=upright)
    used = {one.name for one in colours.values()}
    used |= {one.name for one in assign_colours(second or {}, entries, **scale).values()}
    return [entry for entry in entries if entry.name in used], colours


def settle_achromatic(
    colours: Mapping[int, HoldColour], places: Mapping[int, Floats], *, upright: bool
) -> dict[int, HoldColour]:
    """Return the colours with white, grey and black decided by lightness and neighbours.

    Numbered clusters ("grey 2") count as their colour. Holds of other colours stay as they are, and
    so does a gym with one achromatic colour.

    Parameters
    ----------
    colours : of holds, by id; volumes are left to the caller.
    places : (3,) position of each hold, metres; upright : whether z is up.
    """
    settled = dict(colours)
    ids = [number for number, one in colours.items() if _base_name(one.name) in ACHROMATIC]
    names = np.array(
        [ACHROMATIC.index(_base_name(colours[number].name)) for number in ids], np.int64
    )
    if not ids:
        return settled
    rgb = np.array([colours[number].rgb for number in ids], dtype=np.uint8)
    lightness = oklab_from_linear(linear_from_srgb8(rgb))[:, 0]
    own = np.full((len(ids), len(ACHROMATIC)), _IMPOSSIBLE)
    for k in set(names.tolist()):
        centre = float(np.median(lightness[names == k]))
        own[:, k] = -((lightness - centre) ** 2) / (2 * SPREAD**2)
    scale = np.array([ACROSS, ACROSS, UPWARD] if upright else [1.0, 1.0, 1.0])
    points = np.array([places[number] for number in ids]) * scale
    share = _mean_field(own, WEIGHT * np.exp(-((cdist(points, points) / REACH) ** 2) / 2))
    for number, before, row in zip(ids, names.tolist(), share, strict=True):
        best, (second, first) = int(row.argmax()), np.sort(row)[-2:]
        confidence = colours[number].confidence if best == before else float(first - second)
        settled[number] = replace(colours[number], name=ACHROMATIC[best], confidence=confidence)
    return settled


def _base_name(name: str) -> str:
    """Return the name of a cluster without its number."""
    word, _, number = name.rpartition(" ")
    return word if number.isdecimal() else name


def _mean_field(own: Floats, weights: Floats) -> Floats:
    """Return the (n, k) probabilities of the states from (n, k) log evidence.

    Parameters
    ----------
    weights : (n, n), gain of the log evidence for a state that a neighbour has.
    """
    np.fill_diagonal(weights, 0.0)
    share = _normalised(own)
    for _ in range(ROUNDS):
        share = _normalised(own + weights @ share)
    return share


def _normalised(log: Floats) -> Floats:
    values = np.exp(log - log.max(axis=1, keepdims=True))
    return np.asarray(values / values.sum(axis=1, keepdims=True))
