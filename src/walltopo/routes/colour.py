"""The colour of each hold, without training: one light for all photos, medians, a palette."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.routes.light import SceneLight
from walltopo.routes.oklab import features, linear_from_srgb8, srgb8_from_linear
from walltopo.routes.palette import Entry, cluster_colours, name_of
from walltopo.routes.samples import HoldView

__all__ = ["Coloured", "HoldPaint", "assign_colours", "paint_over_views"]

Floats = NDArray[np.float64]

WHITE_LEVEL = 0.80  # luminance given to the brightest paint of a scan (white paint: 0.7 to 0.85)
REACH = 2.0  # times `colour_spread`: farther from every palette entry a colour is unknown


@dataclass(frozen=True, eq=False)
class HoldPaint:
    """One hold's colour over all views.

    Parameters
    ----------
    linear : (3,) float64 linear RGB under the scan's mean light.
    views : (n, 3) the same per view; weights : (n,) their weights.
    """

    linear: Floats
    views: Floats
    weights: Floats


@dataclass(frozen=True)
class Coloured:
    """What a hold is called and how sure that is.

    Parameters
    ----------
    name : of the palette, or "unknown".
    rgb : the hold's own colour, 0..255.
    confidence : margin between the two nearest palette entries times agreement of the views.
    """

    name: str
    rgb: tuple[int, int, int]
    confidence: float


def _weighted_median(values: Floats, weights: Floats) -> Floats:
    """Per column of (n, k) values."""
    result = np.zeros(values.shape[1])
    for column in range(values.shape[1]):
        order = np.argsort(values[:, column], kind="stable")
        total = np.cumsum(weights[order])
        result[column] = values[order[int(np.searchsorted(total, total[-1] / 2))], column]
    return result


def paint_over_views(
    views: Mapping[int, Sequence[HoldView]],
    light: SceneLight,
    positions: Mapping[int, Floats],
    max_views: int,
) -> dict[int, HoldPaint]:
    """Each hold's colour under one light: the weighted median over its best views.

    The photo's gain and the light that falls on the wall around the hold are divided out.
    Then all holds are scaled together so that the brightest paint has `WHITE_LEVEL`.

    Parameters
    ----------
    views : hold id to its views; positions : hold id to (3,) world position.
    """
    paints: dict[int, HoldPaint] = {}
    for hold, seen in views.items():
        best = sorted(seen, key=lambda view: (-view.quality, view.photo))[:max_views]
        local = float(light.at(positions[hold][None])[0])
        rows = np.array([view.linear * np.exp(-light.gain[view.photo] - local) for view in best])
        weights = np.array([view.quality for view in best])
        paints[hold] = HoldPaint(_weighted_median(rows, weights), rows, weights)
    return _to_white_level(paints)


def _to_white_level(paints: dict[int, HoldPaint]) -> dict[int, HoldPaint]:
    if not paints:
        return paints
    luminance = [float(p.linear @ np.array([0.2126, 0.7152, 0.0722])) for p in paints.values()]
    factor = WHITE_LEVEL / max(float(np.percentile(luminance, 98)), 1e-6)
    return {
        hold: HoldPaint(paint.linear * factor, paint.views * factor, paint.weights)
        for hold, paint in paints.items()
    }


def _rgb(linear: Floats) -> tuple[int, int, int]:
    red, green, blue = (int(v) for v in srgb8_from_linear(linear))
    return red, green, blue


def _found_palette(
    points: Floats, paints: Sequence[HoldPaint], spread: float, lightness_weight: float
) -> list[Entry]:
    """Cluster the holds' colours and name each cluster; equal names get a number."""
    weights = np.array([np.sqrt(paint.weights.sum()) for paint in paints])
    groups = cluster_colours(points, weights, spread)
    entries: list[Entry] = []
    used: dict[str, int] = {}
    for number in range(int(groups.max()) + 1):
        rows = np.flatnonzero(groups == number).tolist()
        rgb = _rgb(np.median([paints[row].linear for row in rows], axis=0))
        name = name_of(rgb, lightness_weight)
        used[name] = used.get(name, 0) + 1
        entries.append(Entry(name if used[name] == 1 else f"{name} {used[name]}", rgb))
    return entries


def assign_colours(
    paints: Mapping[int, HoldPaint],
    palette: Sequence[Entry] | None,
    *,
    spread: float,
    lightness_weight: float,
) -> tuple[dict[int, Coloured], list[Entry]]:
    """Name the colour of each hold.

    Parameters
    ----------
    paints : hold id to its paint.
    palette : the gym's colours; None: found by clustering the paints.
    spread, lightness_weight : see `params.ClassifySettings`.

    Returns
    -------
    Hold id to its colour, and the palette used.
    """
    if not paints:
        return {}, list(palette or [])
    ids, values = list(paints), list(paints.values())
    points = features(np.array([paint.linear for paint in values]), lightness_weight)
    given = palette is not None
    entries = (
        list(palette)
        if palette is not None
        else _found_palette(points, values, spread, lightness_weight)
    )
    anchors = features(
        linear_from_srgb8(np.array([entry.rgb for entry in entries], dtype=np.uint8)),
        lightness_weight,
    )
    names = np.array([entry.name for entry in entries])
    coloured: dict[int, Coloured] = {}
    for hold, paint, point in zip(ids, values, points, strict=True):
        distance = np.linalg.norm(anchors - point, axis=1)
        nearest = int(distance.argmin())
        name = str(names[nearest])
        others = distance[names != name]
        margin = 1.0
        if len(others):
            margin = float(1 - distance[nearest] / max(float(others.min()), 1e-9))
        own = features(paint.views, lightness_weight)
        votes = names[np.linalg.norm(own[:, None] - anchors[None], axis=2).argmin(axis=1)]
        agreement = float(paint.weights[votes == name].sum() / paint.weights.sum())
        known = not given or distance[nearest] <= REACH * spread
        coloured[hold] = Coloured(
            name if known else "unknown", _rgb(paint.linear), margin * agreement if known else 0.0
        )
    return coloured, entries
