"""Fit the weights of `walltopo.describe.routes.start_and_top` on scans of generated gyms."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from walltopo.describe.routes import start_and_top as ends
from walltopo.describe.routes import start_and_top as hands
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_lab.train.ends.seen import SCANS, SeenGym, simulate_scan

Floats = NDArray[np.float64]
RIDGE = 1e-3  # ridge penalty on the weights of cues with unit standard deviation


@dataclass(frozen=True)
class Regression:
    """A logistic regression: weights of cues by name, and the bias."""

    weights: dict[str, float]
    bias: float

    @classmethod
    def of(
        cls, names: Sequence[str], cues: Floats, right: NDArray[np.bool_], most: float | None
    ) -> Regression:
        """Fit a regression to correctness labels, with no weight above `most`.

        A low-confidence cue with a positive weight comes from too few cases, which `most` = 0
        prevents.
        """
        spread = np.maximum(cues.std(axis=0), 1e-9)
        table = np.column_stack([np.ones(len(cues)), cues / spread])

        def loss(values: Floats) -> tuple[float, Floats]:
            odds = table @ values
            free = np.r_[0.0, values[1:]]
            off = 1 / (1 + np.exp(-odds)) - right
            value = (np.logaddexp(0, odds) - right * odds).mean() + RIDGE * (free @ free) / 2
            return float(value), table.T @ off / len(off) + RIDGE * free

        bounds = [(None, None)] + [(None, most)] * cues.shape[1]
        found = minimize(loss, np.zeros(len(bounds)), jac=True, bounds=bounds).x
        weights = (found[1:] / spread).round(3).tolist()
        return cls(dict(zip(names, weights, strict=True)), round(float(found[0]), 3))


@dataclass(frozen=True, eq=False)
class Row:
    """A route of a simulated scan: its start and top holds, and whether they are correct.

    Parameters
    ----------
    true : whether the route has most of a true route's holds; otherwise neither end can be correct.
    """

    ends: ends.StartAndTop
    start: bool
    top: bool
    true: bool


def ends_anew(
    routes: Sequence[Route], holds: Sequence[Hold], left_out: Sequence[Hold]
) -> list[ends.StartAndTop]:
    """Return the start and top of a scan's routes by the current rule; hold groups are kept."""
    by_id = {hold.id: hold for hold in holds}
    groups = [[by_id[number] for number in route.holds] for route in routes]
    used = {number for route in routes for number in route.holds}
    wall = ends.wall_stats(groups, holds)
    wall = wall.with_strays((hold for hold in holds if hold.id not in used), left_out)
    found = []
    for route, group in zip(routes, groups, strict=True):
        rivals = {row.hold: {int(k): p for k, p in row.routes.items()} for row in route.ambiguous}
        found.append(ends.find_start_and_top(group, wall, rivals, route.id))
    return found


def rows_of(seen: SeenGym) -> list[Row]:
    """Return the routes of a simulated scan, with start and top by the current rule."""
    found = ends_anew(seen.routes, seen.holds, seen.left_out)
    by_id = {route.id: one for route, one in zip(seen.routes, found, strict=True)}
    rows = []
    for route, true in seen.matched():
        one = by_id[route.id]
        start = true is not None and {hold.id for hold in one.start} == true.start
        top = true is not None and {one.top.id} == true.top
        rows.append(Row(one, start, top, true is not None))
    return rows


def fit_hands(seen: Iterable[SeenGym]) -> Regression:
    """Fit the classification of hand holds against footholds."""
    cues, right = [], []
    for gym in seen:
        known = [hold for hold in gym.holds if hold.id in gym.part]
        cues.append(hands.hand_cues(known, ends.wall_stats([], gym.holds).usual))
        right += [gym.part[hold.id] != "foot" for hold in known]
    return Regression.of(("foothold", "other", "size"), np.vstack(cues), np.array(right), most=None)


@dataclass(frozen=True)
class EndsFit:
    """The regressions of the start and of the top."""

    start: Regression
    top: Regression


def fit_ends(rows: Sequence[Row]) -> EndsFit:
    """Fit whether a start or top is correct, from the cues against it."""
    found = []
    for end in ("start", "top"):
        confidences = [getattr(row.ends, f"{end}_confidence") for row in rows]
        cues = np.array([list(one.cues.values()) for one in confidences])
        right = np.array([getattr(row, end) for row in rows])
        found.append(Regression.of(list(confidences[0].cues), cues, right, most=0.0))
    return EndsFit(*found)


def scans_of(seeds: Iterable[int]) -> list[SeenGym]:
    """Return `SCANS` simulated scans of each gym."""
    return [simulate_scan(seed, scan) for seed in seeds for scan in range(SCANS)]
