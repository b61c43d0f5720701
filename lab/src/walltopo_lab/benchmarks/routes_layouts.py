"""Route layouts to choose defaults on: holds of routes on an unrolled wall, no pictures.

Made for choosing only; what is reported comes from other gyms (see `benchmarks/routes.py`).
A wall is unrolled: u runs along it, v up it, both in metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Layout", "make_layout"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Layout:
    """Holds of one wall.

    Parameters
    ----------
    points : (n, 2) float64, u and v in metres.
    colour, route : (n,) int64.
    """

    points: Floats
    colour: NDArray[np.int64]
    route: NDArray[np.int64]


def _route(rng: np.random.Generator, middle: float, height: float) -> Floats:
    """(n, 2) holds of one route: a wandering line of hand holds, footholds below them."""
    rise = rng.uniform(0.33, 0.55)
    count = max(5, int((height - 1.0) / rise))
    v = np.linspace(rng.uniform(0.5, 1.1), height - rng.uniform(0.1, 0.5), count)
    drift = rng.normal(0, 0.8 if rng.random() < 0.3 else 0.3)
    wander = np.cumsum(rng.normal(0, 0.12, count))
    side = rng.uniform(0.1, 0.35) * (-1.0) ** np.arange(count)
    u = middle + drift * np.linspace(-0.5, 0.5, count) + wander - wander.mean() + side
    hands = np.column_stack([u, v + rng.normal(0, 0.05, count)])
    feet = rng.integers(0, max(1, count // 2) + 1)
    under = hands[rng.integers(count, size=feet)]
    under = under + np.column_stack([rng.normal(0, 0.3, feet), -rng.uniform(0.3, 0.9, feet)])
    holds = np.vstack([hands, under[under[:, 1] > 0.15]])
    return holds[rng.random(len(holds)) > 0.03]  # some are not found


def make_layout(seed: int) -> Layout:
    """One wall; a quarter of the walls is for lead climbing, high and with long routes.

    Routes stand 0.6 to 1.2 m apart; a colour comes back after at least 2.2 m, as setters
    keep routes of one colour apart for the climbers.
    """
    rng = np.random.default_rng([7919, seed])
    lead = rng.random() < 0.25
    height = rng.uniform(9, 14) if lead else rng.uniform(3.4, 4.8)
    width = rng.uniform(5, 16)
    colours = int(rng.integers(5, 12))
    spacing = rng.uniform(0.6, 1.2)
    middles = np.arange(0.4, width, spacing)
    middles = middles + rng.normal(0, 0.12, len(middles))
    last: dict[int, float] = {}
    points, colour, route = [], [], []
    for number, middle in enumerate(middles.tolist()):
        free = [c for c in range(colours) if middle - last.get(c, -np.inf) > 2.2]
        if not free:
            continue
        pick = int(rng.choice(free))
        last[pick] = middle
        holds = _route(rng, middle, height)
        points.append(holds)
        colour.append(np.full(len(holds), pick))
        route.append(np.full(len(holds), number))
    return Layout(np.vstack(points), np.concatenate(colour), np.concatenate(route))
