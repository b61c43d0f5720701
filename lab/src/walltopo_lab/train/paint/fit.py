"""Fit the link model of `walltopo.describe.routes.grouping`: `walltopo train paint FOLDER`."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import LogisticRegression

from walltopo.core import Progress
from walltopo.describe.routes import grouping as linking
from walltopo.describe.routes.grouping import best_louvain, candidate_pairs
from walltopo_lab.train.paint.holds import PhotoHolds, of_generated, route_ari, straight_distances
from walltopo_lab.train.paint.photos import DimPhoto

SHARPENINGS = (2, 3, 4)
RESOLUTIONS = (1.5, 2.0, 2.5, 3.0)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _pairs_in_reach(holds: PhotoHolds) -> tuple[Ints, Floats, Ints]:
    """Return pairs within reach, their cues, and 1 same route, 0 different, -1 unknown."""
    points = holds.points
    pairs = candidate_pairs(points, [""] * len(points), linking.FLATTEN, linking.REACH)
    paint = linking.balanced_paint(holds.linear, holds.tint)
    lengths = straight_distances(points, pairs, linking.FLATTEN)
    cues = linking.cues_of(points, paint, pairs, lengths)
    one, two = [[holds.routes[k] for k in pairs[:, side]] for side in (0, 1)]
    same = [-1 if None in (a, b) else int(a == b) for a, b in zip(one, two, strict=True)]
    return pairs, cues, np.array(same)


def _regress(tables: list[tuple[Ints, Floats, Ints]]) -> tuple[Floats, float]:
    cues = np.vstack([cues[same >= 0] for _, cues, same in tables])
    same = np.concatenate([same[same >= 0] for _, _, same in tables])
    spread = cues.std(axis=0)
    model = LogisticRegression(max_iter=1000).fit(cues / spread, same)
    return model.coef_[0] / spread, float(model.intercept_[0])


def _left_out(
    holds: list[PhotoHolds], part: list[int], sharpen: int, resolution: float
) -> list[float]:
    """Return the ARI of each photo by a fit to the other half of the gyms."""
    tables = [_pairs_in_reach(one) for one in holds]
    fits = [_regress([t for t, p in zip(tables, part, strict=True) if p != k]) for k in (0, 1)]
    values = []
    for one, (pairs, cues, _), side in zip(holds, tables, part, strict=True):
        weights, bias = fits[side]
        link = (1 / (1 + np.exp(-(cues @ weights + bias)))) ** sharpen
        links = np.zeros((len(one.points), len(one.points)))
        links[pairs[:, 0], pairs[:, 1]] = np.where(link < linking.MIN_LINK, 0, link)
        values.append(route_ari(one, best_louvain(links + links.T, resolution, 0)))
    return values


@dataclass(frozen=True)
class PaintFit:
    """The regression, and its grouping accuracy on photos of held-out gyms.

    Parameters
    ----------
    weights, bias : `WEIGHTS` and `BIAS` of `walltopo.describe.routes.grouping`.
    left_out : sharpening and `paint.RESOLUTION` to the mean and worst ARI.
    """

    weights: list[float]
    bias: float
    left_out: dict[tuple[int, float], tuple[float, float]]


def fit_paint(photos: list[DimPhoto], progress: Progress) -> PaintFit:
    """Fit the probability that two holds belong to the same route to their cues."""
    progress.step("reading photos", len(photos))
    holds = []
    for photo in photos:
        holds.append(of_generated(photo))
        progress.advance()
    part = [int(photo.name.split("_")[0]) % 2 for photo in photos]
    tried = list(itertools.product(SHARPENINGS, RESOLUTIONS))
    progress.step("leaving gyms out", len(tried))
    left_out = {}
    for sharpen, resolution in tried:
        values = _left_out(holds, part, sharpen, resolution)
        left_out[sharpen, resolution] = float(np.mean(values)), float(np.min(values))
        progress.advance()
    weights, bias = _regress([_pairs_in_reach(one) for one in holds])
    return PaintFit(weights.round(3).tolist(), round(bias, 3), left_out)
