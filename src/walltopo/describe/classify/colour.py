"""The colour of each hold, without training: one light for all photos, medians, a palette."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.palette import Entry, cluster_colours, name_of
from walltopo.images.colour import features, linear_from_srgb8, srgb8_from_linear
from walltopo.scans.pictures import SceneLight

Floats = NDArray[np.float64]

MAX_VIEWS = 12  # views from which the colour of one hold is taken
WHITE_LEVEL = 0.80  # luminance given to the brightest paint of a scan (white paint: 0.7 to 0.85)
VOLUME_REACH = 1.0  # times `colour_spread`: a volume this near to a hold colour has that colour
REACH = 3.0  # times `colour_spread`: farther from every palette entry a colour is unknown


@dataclass(frozen=True, eq=False)
class HoldPaint:
    """The colour of one hold over all views.

    Parameters
    ----------
    linear : (3,) float64 linear RGB under the scan's mean light.
    views : (n, 3) linear RGB per view; weights : (n,) their weights.
    """

    linear: Floats
    views: Floats
    weights: Floats


@dataclass(frozen=True)
class HoldColour:
    """The named colour of a hold.

    Parameters
    ----------
    name : name in the palette, or "unknown".
    rgb : the hold's own colour, 0..255.
    confidence : margin between the two nearest palette entries, times agreement of the views.
    """

    name: str
    rgb: tuple[int, int, int]
    confidence: float


def _weighted_median(values: Floats, weights: Floats) -> Floats:
    """Return the weighted median of each column of (n, k) values."""
    result = np.zeros(values.shape[1])
    for column in range(values.shape[1]):
        order = np.argsort(values[:, column], kind="stable")
        total = np.cumsum(weights[order])
        result[column] = values[order[int(np.searchsorted(total, total[-1] / 2))], column]
    return result


def paint_over_views(
    views: Mapping[int, Sequence[HoldView]], light: SceneLight
) -> dict[int, HoldPaint]:
    """Return each hold's colour under one light: the weighted median over its best views.

    The photo's gain is divided out. All holds are scaled together by the light's `white` (see
    `with_white`). The wall's brightness around a hold is not: panels differ more by their paint
    than by their light (docs/colours.md).

    Parameters
    ----------
    views : hold id to views.
    """
    paints: dict[int, HoldPaint] = {}
    for hold, seen in views.items():
        best = sorted(seen, key=lambda view: (-view.quality, view.photo))[:MAX_VIEWS]
        rows = np.array([view.linear * light.factor(view.photo) for view in best])
        weights = np.array([view.quality for view in best])
        paints[hold] = median_paint(rows, weights)
    return paints


def median_paint(rows: Floats, weights: Floats) -> HoldPaint:
    """Return the weighted median of the (n, 3) linear RGB of some views."""
    return HoldPaint(_weighted_median(rows, weights), rows, weights)


def with_white(light: SceneLight, views: Mapping[int, Sequence[HoldView]]) -> SceneLight:
    """Return the light with the factor that gives the scan's brightest paint `WHITE_LEVEL`."""
    paints = paint_over_views(views, replace(light, white=1.0))
    if not paints:
        return replace(light, white=1.0)
    luminance = [float(p.linear @ np.array([0.2126, 0.7152, 0.0722])) for p in paints.values()]
    # If all holds are darker than the wall, none of them is white.
    white = WHITE_LEVEL / max(float(np.percentile(luminance, 98)), light.wall, 1e-6)
    return replace(light, white=white)


def _rgb(linear: Floats) -> tuple[int, int, int]:
    red, green, blue = (int(v) for v in srgb8_from_linear(linear))
    return red, green, blue


def _cluster_palette(
    paints: Sequence[HoldPaint], spread: float, lightness_weight: float, taken: Sequence[str] = ()
) -> list[Entry]:
    """Return palette entries by clustering; a name that is taken gets a number."""
    if not paints:
        return []
    linear = np.array([paint.linear for paint in paints])
    points = features(linear, lightness_weight)
    entries: list[Entry] = []
    used = set(taken)
    for term, rows in cluster_colours(points, spread, lightness_weight).items():
        rgb = _rgb(np.median(linear[rows], axis=0))
        # The centre may have moved away from the term at which it started.
        wanted = [name_of(rgb, lightness_weight), term]
        numbered = [f"{wanted[0]} {number}" for number in range(2, 2 + len(used))]
        name = next(name for name in wanted + numbered if name not in used)
        used.add(name)
        entries.append(Entry(name, rgb))
    return entries


def _anchors(entries: Sequence[Entry], lightness_weight: float) -> Floats:
    rgb = np.array([entry.rgb for entry in entries], dtype=np.uint8).reshape(-1, 3)
    return features(linear_from_srgb8(rgb), lightness_weight)


def find_palette(
    paints: Mapping[int, HoldPaint],
    volumes: Collection[int],
    second: Sequence[HoldPaint] = (),
    /,
    *,
    spread: float,
    lightness_weight: float,
) -> list[Entry]:
    """Return the colours of a scan by clustering its holds, most frequent colour first.

    Volumes do not influence the palette of the holds: plywood lies between orange, grey and
    white, and would merge them. Volumes that match no colour of the holds are clustered
    separately, and their colours come last.

    Parameters
    ----------
    second : the second paints of two-coloured holds, which count as those of further holds.
    """
    holds = [number for number in paints if number not in volumes] or list(paints)
    own = [*(paints[k] for k in holds), *second]
    entries = _cluster_palette(own, spread, lightness_weight)
    anchors = _anchors(entries, lightness_weight)
    unmatched = [
        paint
        for number, paint in paints.items()
        if number in volumes
        and np.linalg.norm(anchors - features(paint.linear, lightness_weight), axis=1).min()
        > VOLUME_REACH * spread
    ]
    names = [entry.name for entry in entries]
    return entries + _cluster_palette(unmatched, spread, lightness_weight, names)


def assign_colours(
    paints: Mapping[int, HoldPaint],
    palette: Sequence[Entry],
    *,
    spread: float,
    lightness_weight: float,
) -> dict[int, HoldColour]:
    """Return the name of each hold's colour: the nearest entry of a palette.

    A colour farther than `REACH` times `spread` from every entry is "unknown". The confidence
    is the margin to the nearest entry with another name, times the share of the views that
    agree.

    Parameters
    ----------
    paints : hold id to paint.
    palette : the gym's colours (`find_palette`, or a palette file); several may share a name.
    spread, lightness_weight : see `ClassifySettings`.
    """
    anchors = _anchors(palette, lightness_weight)
    names = np.array([entry.name for entry in palette])
    coloured: dict[int, HoldColour] = {}
    for hold, paint in paints.items():
        distance = np.linalg.norm(anchors - features(paint.linear, lightness_weight), axis=1)
        nearest = int(distance.argmin())
        name = str(names[nearest])
        if distance[nearest] > REACH * spread:
            coloured[hold] = HoldColour("unknown", _rgb(paint.linear), 0.0)
            continue
        others = distance[names != name]
        # If the gym has only one colour, no other can be confused with it.
        rival = float(others.min()) if len(others) else np.inf
        margin = 1 - float(distance[nearest]) / max(rival, 1e-9)
        own = features(paint.views, lightness_weight)
        votes = names[np.linalg.norm(own[:, None] - anchors[None], axis=2).argmin(axis=1)]
        agreement = float(paint.weights[votes == name].sum() / paint.weights.sum())
        coloured[hold] = HoldColour(name, _rgb(paint.linear), margin * agreement)
    return coloured
