"""Fit the weights of `walltopo.describe.routes.start_and_top` on scans of generated gyms."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from walltopo.describe.routes import start_and_top as ends
from walltopo.describe.routes import start_and_top as hands
from walltopo.scans.attributes import Doubtful, Hold
from walltopo.scans.routes import Route
from walltopo_lab.train.ends.seen import SCANS, SeenGym, see

Floats = NDArray[np.float64]
RIDGE = 1e-3  # on weights of cues of spread 1


@dataclass(frozen=True)
class Regression:
    """Weights of cues, by name, and what is added."""

    weights: dict[str, float]
    bias: float

    @classmethod
    def of(
        cls, names: Sequence[str], cues: Floats, right: NDArray[np.bool_], most: float | None
    ) -> Regression:
        """Fitted to whether something is right, no weight above `most`.

        A cue of doubt that speaks for an end in the fit has met too few cases: `most` = 0.
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
    """A route of a simulated scan: its ends, and whether they are right.

    Parameters
    ----------
    true : whether most of a true route's holds are in it; else neither end can be right.
    """

    ends: ends.Ends
    start: bool
    top: bool
    true: bool


def ends_anew(
    routes: Sequence[Route], holds: Sequence[Hold], left_out: Sequence[Doubtful]
) -> list[ends.Ends]:
    """The ends of a scan's routes by the rule as it stands, the groups of holds being kept."""
    by_id = {hold.id: hold for hold in holds}
    groups = [[by_id[number] for number in route.holds] for route in routes]
    used = {number for route in routes for number in route.holds}
    wall = ends.wall_of(groups, holds)
    wall = wall.beside((hold for hold in holds if hold.id not in used), left_out)
    found = []
    for route, group in zip(routes, groups, strict=True):
        rivals = {row.hold: {int(k): p for k, p in row.routes.items()} for row in route.ambiguous}
        found.append(ends.find_ends(group, wall, rivals, route.id))
    return found


def rows_of(seen: SeenGym) -> list[Row]:
    """The routes of a simulated scan, their ends by the rule as it stands."""
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
    """Hand holds against footholds."""
    cues, right = [], []
    for gym in seen:
        known = [hold for hold in gym.holds if hold.id in gym.part]
        cues.append(hands.hand_cues(known, ends.wall_of([], gym.holds).usual))
        right += [gym.part[hold.id] != "foot" for hold in known]
    return Regression.of(("foothold", "other", "size"), np.vstack(cues), np.array(right), most=None)


@dataclass(frozen=True)
class EndsFit:
    """The regressions of start and of top."""

    start: Regression
    top: Regression


def fit_ends(rows: Sequence[Row]) -> EndsFit:
    """Which ends are right, by what speaks against them."""
    found = []
    for end in ("start", "top"):
        doubts = [getattr(row.ends, f"{end}_doubt") for row in rows]
        cues = np.array([list(doubt.cues.values()) for doubt in doubts])
        right = np.array([getattr(row, end) for row in rows])
        found.append(Regression.of(list(doubts[0].cues), cues, right, most=0.0))
    return EndsFit(*found)


def scans_of(seeds: Iterable[int]) -> list[SeenGym]:
    """`SCANS` simulated scans of each gym."""
    return [see(seed, scan) for seed in seeds for scan in range(SCANS)]
