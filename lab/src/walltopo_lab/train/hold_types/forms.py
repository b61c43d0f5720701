"""Synthetic holds from a shape grammar: height maps over the wall, by hold type.

They complement the generator's holds, so that the network learns what jugs of all makers share and
not one generator's modelling. A form is a height map on a square grid, row 0 on top: (n, n) metres,
at most 0 outside the hold.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Grid:
    """A square grid of n x n pixels of `pixel` metres; x right, y up, origin in the centre."""

    def __init__(self, n: int, pixel: float) -> None:
        axis = (np.arange(n) - (n - 1) / 2) * pixel
        self.pixel = pixel
        self.x, self.y = np.meshgrid(axis, -axis)

    def turned(self, degrees: float) -> tuple[Floats, Floats]:
        """Return the x and y coordinates in the frame of a hold rotated counter-clockwise."""
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        return c * self.x + s * self.y, -s * self.x + c * self.y


def _ripple(angle: Floats, rng: np.random.Generator, amount: float) -> Floats:
    """Return a smooth closed ripple around 1."""
    total = np.ones_like(angle)
    for k in range(2, 6):
        total += amount / k * rng.normal() * np.cos(k * angle + rng.uniform(0, 2 * np.pi))
    return np.maximum(total, 0.5)


def _outline_radius(x: Floats, y: Floats, w: float, h: float, rng: np.random.Generator) -> Floats:
    """Return 0 at the centre and 1 on the outline of a random, bent and rippled shape.

    The shape is an oval, a box, a polygon or a blend of them.
    """
    bend, taper = rng.normal(0, 0.25) * min(w, h), rng.normal(0, 0.2)
    u = x / (w / 2) / (1 + taper * np.clip(2 * y / h, -1, 1))
    v = (y - bend * ((2 * x / w) ** 2 - 0.3)) / (h / 2)
    if rng.random() < 0.25:
        sides = int(rng.integers(3, 8))
        turns = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(sides) / sides
        turns += rng.normal(0, 0.15, sides)
        reach = rng.uniform(0.75, 1.0, sides)
        planes = [(np.cos(t) * u + np.sin(t) * v) / r for t, r in zip(turns, reach, strict=True)]
        r = np.max(planes, axis=0)
    else:
        power = rng.choice([rng.uniform(1.5, 2.5), rng.uniform(2.5, 6)])
        r = (np.abs(u) ** power + np.abs(v) ** power) ** (1 / power)
    return np.asarray(r / _ripple(np.arctan2(v, u), rng, 0.12))


def _height_profile(r: Floats, rng: np.random.Generator) -> Floats:
    """Return 1 at the centre, 0 from r = 1 on: a dome, a cushion, a table or a cone."""
    kind = rng.random()
    inside = np.clip(1 - r, 0, 1)
    if kind < 0.4:
        return np.sqrt(np.clip(1 - np.minimum(r, 1) ** 2, 0, 1)) ** rng.uniform(0.7, 1.3)
    if kind < 0.7:
        return np.clip(1 - np.minimum(r, 1) ** rng.uniform(2, 5), 0, 1)
    if kind < 0.9:
        return np.clip(inside / rng.uniform(0.15, 0.6), 0, 1)
    return inside ** rng.uniform(0.7, 1.1)


def _soft_step(t: Floats, width: float) -> Floats:
    return np.asarray(0.5 + 0.5 * np.tanh(2 * t / width))


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a random value between two bounds, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _jug(g: Grid, rng: np.random.Generator) -> Floats:
    """Return a jug: a lip, and above and behind it a scoop for the fingers."""
    x, y = g.turned(rng.normal(0, 18))
    w = _log_uniform(rng, 0.10, 0.28)
    h = w * _log_uniform(rng, 0.45, 1.15)
    depth = float(np.clip(h * _log_uniform(rng, 0.45, 1.0), 0.04, 0.14))
    r = _outline_radius(x, y, w, h, rng)
    body = depth * _height_profile(r, rng) ** rng.uniform(0.4, 1.0)
    slope = 1 + rng.uniform(0.2, 0.7) * np.clip((y / h - 0.1), -0.6, 0)  # lower part leans back
    lip = rng.uniform(-0.05, 0.25) * h
    bow = rng.uniform(-0.15, 0.35) * h * (2 * x / w) ** 2
    behind = _soft_step(y - lip - bow, rng.uniform(0.006, 0.02))
    floor = rng.uniform(0.05, 0.55)
    if rng.random() < 0.45:  # a rim at the sides and the back: a bucket
        wide = rng.uniform(0.6, 0.85)
        behind *= _soft_step(wide - np.abs(2 * x / w), 0.15)
        behind *= _soft_step(rng.uniform(0.75, 0.95) - r, 0.15)
    return np.asarray(body * slope * (1 - (1 - floor) * behind))


def _crimp(g: Grid, rng: np.random.Generator) -> Floats:
    """Return a crimp, a fingertip edge: low, wide, steep above, sloping off below."""
    x, y = g.turned(rng.normal(0, 25))
    w = _log_uniform(rng, 0.06, 0.24)
    h = float(np.clip(w * _log_uniform(rng, 0.2, 0.55), 0.022, 0.085))
    depth = float(np.clip(h * _log_uniform(rng, 0.4, 1.0), 0.012, 0.05))
    r = _outline_radius(x, y, w, h, rng)
    edge = rng.uniform(0.05, 0.4) * h + rng.normal(0, 0.12) * h * (2 * x / w) ** 2
    above = _soft_step(edge - y, rng.uniform(0.004, 0.014))
    ramp = np.clip(1 - rng.uniform(0.2, 1.0) * (edge - y) / h, 0.05, 1)
    flat = rng.uniform(0.25, 0.8)
    return np.asarray(depth * _height_profile(r, rng) ** flat * above * ramp)


def _sloper(g: Grid, rng: np.random.Generator) -> Floats:
    """Return a sloper: large and round, or a large slanting shelf, without an edge."""
    x, y = g.turned(rng.normal(0, 30))
    w = _log_uniform(rng, 0.13, 0.5)
    h = w * _log_uniform(rng, 0.5, 1.15)
    depth = float(np.clip(min(w, h) * _log_uniform(rng, 0.25, 0.65), 0.03, 0.22))
    body = depth * _height_profile(_outline_radius(x, y, w, h, rng), rng)
    if rng.random() < 0.45:
        slant, start = rng.uniform(0.3, 1.4), rng.uniform(-0.15, 0.25) * h
        body = np.minimum(body, depth * rng.uniform(0.7, 1.0) - slant * (y - start))
    return np.maximum(body, 0)


def _pinch(g: Grid, rng: np.random.Generator) -> Floats:
    """Return a pinch: upright, narrow, deep for its width, with steep sides, often a waist."""
    x, y = g.turned(rng.normal(0, 32))
    h = _log_uniform(rng, 0.11, 0.34)
    w = float(np.clip(h * _log_uniform(rng, 0.25, 0.6), 0.035, 0.13))
    depth = float(np.clip(w * _log_uniform(rng, 0.6, 1.25), 0.03, 0.12))
    waist = 1 - rng.uniform(0.0, 0.45) * np.exp(-((y / h / rng.uniform(0.15, 0.35)) ** 2))
    r = _outline_radius(x / waist, y, w, h, rng)
    return np.asarray(depth * _height_profile(r, rng) ** rng.uniform(0.35, 1.0))


def _pocket(g: Grid, rng: np.random.Generator) -> Floats:
    """Return a pocket: holes for one to four fingers in a body without other grips."""
    x, y = g.turned(rng.normal(0, 20))
    w = _log_uniform(rng, 0.08, 0.24)
    h = w * _log_uniform(rng, 0.6, 1.2)
    depth = float(np.clip(min(w, h) * _log_uniform(rng, 0.3, 0.75), 0.025, 0.1))
    body = depth * _height_profile(_outline_radius(x, y, w, h, rng), rng) ** rng.uniform(0.4, 1.0)
    radius = rng.uniform(0.010, 0.017)
    high = radius * _log_uniform(rng, 0.9, 1.8)
    half = min(rng.choice([0.0, 0.011, 0.022, 0.033]), 0.3 * w)
    cx, cy = rng.normal(0, 0.08) * w, rng.uniform(-0.1, 0.22) * h
    away = np.hypot(np.maximum(np.abs(x - cx) - half, 0) / radius, (y - cy) / high)
    hole = _soft_step(1 - away, 0.4)
    return np.asarray(body * (1 - rng.uniform(0.55, 0.95) * hole))


def _foothold(g: Grid, rng: np.random.Generator) -> Floats:
    """Return a foothold: small, of any shape."""
    x, y = g.turned(rng.normal(0, 60))
    w = _log_uniform(rng, 0.025, 0.085)
    h = float(np.clip(w * _log_uniform(rng, 0.45, 1.3), 0.02, 0.07))
    depth = float(np.clip(min(w, h) * _log_uniform(rng, 0.35, 0.95), 0.008, 0.04))
    body = depth * _height_profile(_outline_radius(x, y, w, h, rng), rng)
    if rng.random() < 0.4:
        body = np.minimum(body, depth * 0.8 - rng.uniform(0.3, 1.5) * y)
    return np.maximum(body, 0)


FORMS: dict[str, Callable[[Grid, np.random.Generator], Floats]] = {
    "jug": _jug,
    "crimp": _crimp,
    "sloper": _sloper,
    "pinch": _pinch,
    "pocket": _pocket,
    "foothold": _foothold,
}


def hold_heights(kind: str, grid: Grid, rng: np.random.Generator) -> Floats:
    """Return the (n, n) heights of one hold, metres, with a smooth, ribbed or faceted surface."""
    heights = FORMS[kind](grid, rng)
    there = heights > 0.0015
    if rng.random() < 0.25:
        angle, period = rng.uniform(0, np.pi), rng.uniform(0.015, 0.035)
        along = grid.x * np.cos(angle) + grid.y * np.sin(angle)
        heights = heights + rng.uniform(0.03, 0.08) * heights.max() * np.sin(
            2 * np.pi * along / period
        )
    if rng.random() < 0.3:
        top, reach = heights.max(), max(np.ptp(grid.x[there]), np.ptp(grid.y[there]), 0.01) / 2
        for _ in range(int(rng.integers(2, 7))):
            slope = rng.normal(0, 0.9, 2) * top / reach
            cut = rng.uniform(0.75, 1.1) * top + slope[0] * grid.x + slope[1] * grid.y
            heights = np.minimum(heights, np.maximum(cut, 0.1 * top))
    if rng.random() < 0.7:  # the bolt hole
        size = 0.5 * np.sqrt(there.sum()) * grid.pixel
        x, y = rng.normal(0, 0.12, 2) * size
        bore = np.hypot(grid.x - x, grid.y - y) < rng.uniform(0.1, 0.2) * min(size, 0.06)
        heights = np.where(
            bore, np.minimum(heights, rng.uniform(0.3, 0.7) * heights.max()), heights
        )
    return np.where(there, np.maximum(heights, 0.002), 0.0)
