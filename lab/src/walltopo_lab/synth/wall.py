"""The wall: columns of corners along a bent line, panels between them, creased into facets."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet
from walltopo_lab.synth.params import GymSettings

Floats = NDArray[np.float64]


def _plan_columns(settings: GymSettings, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return foot points (C, 2) of the columns and the outward direction (C, 2) at each."""
    panels = settings.columns - 1
    widths = rng.uniform(0.75, 1.25, panels)
    widths *= settings.width / widths.sum()
    turns = np.radians(rng.uniform(-settings.corner_deg, settings.corner_deg, panels))
    # Headings swing about the x axis, so that a long wall does not curl up.
    headings = np.clip(np.cumsum(turns) * 0.5 + turns * 0.5, -0.7, 0.7)
    headings -= headings.mean()
    steps = np.stack([np.cos(headings), np.sin(headings)], axis=1) * widths[:, None]
    foot = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
    bisected = np.concatenate([headings[:1], (headings[1:] + headings[:-1]) / 2, headings[-1:]])
    outward = np.stack([np.sin(bisected), -np.cos(bisected)], axis=1)
    return foot, outward


def _row_heights(settings: GymSettings, rng: np.random.Generator) -> Floats:
    """Return the heights of the rows of corners: floor, a crease or two, the top."""
    count = max(1, round(settings.height / 2.6)) if settings.facets > 0.3 else 1
    inner = (np.arange(1, count + 1) - 0.45) / (count + 0.3) * settings.height
    return np.concatenate([[0.0], inner + rng.uniform(-0.15, 0.15, count), [settings.height]])


def _panel_corners(settings: GymSettings, rng: np.random.Generator) -> Floats:
    """Return the (R, C, 3) corners of the panels."""
    foot, outward = _plan_columns(settings, rng)
    heights = _row_heights(settings, rng)
    low, high = np.radians([settings.overhang_min_deg, settings.overhang_max_deg])
    lean = rng.uniform(low, high, len(foot))
    # In a plain gym panels, not columns, have a lean, so neighbouring columns share it.
    if settings.facets < 0.5:
        lean[:] = lean.mean() if settings.columns <= 2 else np.repeat(lean[::2], 2)[: len(lean)]
    corners = np.zeros((len(heights), len(foot), 3))
    reach = np.zeros(len(foot))
    for row, height in enumerate(heights):
        if row:
            change = rng.uniform(-0.5, 0.5, len(foot)) * settings.facets
            slope = np.clip(np.tan(lean) * (1 + change), math.tan(low), math.tan(high))
            reach = reach + slope * (height - heights[row - 1])
        # vary z along creases, but not at the floor and the top
        wobble = settings.facets * 0.5 if 0 < row < len(heights) - 1 else 0.0
        corners[row, :, :2] = foot + outward * reach[:, None]
        corners[row, :, 2] = height + rng.uniform(-wobble, wobble, len(foot))
    return corners


def build_wall(settings: GymSettings, rng: np.random.Generator) -> list[Facet]:
    """Return the climbing surface as plane facets; it begins at the origin and faces -y.

    A panel between two columns is cut along one diagonal. If its four corners lie in a plane, it
    stays one facet; otherwise the diagonal is a crease, as in gyms built of facets.
    """
    corners = _panel_corners(settings, rng)
    facets = []
    for row in range(corners.shape[0] - 1):
        for column in range(corners.shape[1] - 1):
            a, b = corners[row, column], corners[row, column + 1]
            d, c = corners[row + 1, column], corners[row + 1, column + 1]
            style = int(rng.integers(1 << 16))
            pair = ([a, b, c], [a, c, d]) if rng.random() < 0.5 else ([a, b, d], [b, c, d])
            flat = abs(np.dot(np.cross(b - a, c - a), d - a)) < 1e-6
            if flat:
                facets.append(Facet(np.array([a, b, c, d]), "wall", style=style))
            else:
                facets += [Facet(np.array(t), "wall", style=style + k) for k, t in enumerate(pair)]
    facets += _place_fins(corners, settings, rng)
    return facets


def _place_fins(corners: Floats, settings: GymSettings, rng: np.random.Generator) -> list[Facet]:
    """Return fins: floor pyramids leaning on an inner column, with two facets and an arete each."""
    facets: list[Facet] = []
    inner = np.arange(1, corners.shape[1] - 1)
    for column in rng.permutation(inner)[: settings.fins]:
        foot, height = corners[0, column], rng.uniform(0.55, 0.85) * settings.height
        path = corners[:, column]
        apex = np.array([np.interp(height, path[:, 2], path[:, k]) for k in range(3)])
        left = foot + (corners[0, column - 1] - foot) * rng.uniform(0.25, 0.4)
        right = foot + (corners[0, column + 1] - foot) * rng.uniform(0.25, 0.4)
        out = np.cross([0.0, 0.0, 1.0], left - right)
        out /= np.linalg.norm(out)
        apex = apex + out * 0.05
        ridge = foot + out * rng.uniform(0.3, 0.55) + out * max(0.0, (apex - foot) @ out)
        ridge = ridge * [1, 1, 0]
        style = int(rng.integers(1 << 16))
        facets.append(Facet(np.array([left, ridge, apex]), "fin", style=style))
        facets.append(Facet(np.array([ridge, right, apex]), "fin", style=style + 1))
    return facets


def build_hall(wall: list[Facet], settings: GymSettings) -> list[Facet]:
    """Return the mats in front of the wall, the room around it, and its benches."""
    points = np.concatenate([f.corners for f in wall])
    low, high = points.min(axis=0), points.max(axis=0)
    x0, x1 = low[0] - settings.room, high[0] + settings.room
    front, back = low[1] - 5.5, high[1] + 0.8
    roof = settings.height + 1.6

    def quad(a: list[float], b: list[float], c: list[float], d: list[float]) -> Floats:
        return np.array([a, b, c, d], dtype=np.float64)

    floor = quad([x0, front, 0], [x1, front, 0], [x1, back, 0], [x0, back, 0])
    rear = quad([x0, back, 0], [x1, back, 0], [x1, back, roof], [x0, back, roof])
    left = quad([x0, front, 0], [x0, back, 0], [x0, back, roof], [x0, front, roof])
    right = quad([x1, back, 0], [x1, front, 0], [x1, front, roof], [x1, back, roof])
    ceiling = quad([x0, back, roof], [x1, back, roof], [x1, front, roof], [x0, front, roof])
    return [
        Facet(floor, "floor", texel=0.006),
        Facet(rear, "concrete", texel=0.008, style=1),
        Facet(left, "concrete", texel=0.008, style=2),
        Facet(right, "concrete", texel=0.008, style=3),
        Facet(ceiling, "ceiling", texel=0.012),
        *_place_benches(low, high, settings.benches),
    ]


def _place_benches(low: Floats, high: Floats, count: int) -> list[Facet]:
    """Return benches, evenly along the wall and a step before it."""
    facets: list[Facet] = []
    for number in range(count):
        middle = low[0] + (high[0] - low[0]) * (number + 0.5) / count
        x0, x1 = middle - 0.6, middle + 0.6
        y0, y1, z = low[1] - 1.1, low[1] - 0.7, 0.45
        foot = [[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]]
        seat = [[x, y, z] for x, y, _ in foot]
        for k in range(4):
            side = [foot[k], foot[(k + 1) % 4], seat[(k + 1) % 4], seat[k]]
            facets.append(Facet(np.array(side), "concrete", texel=0.004, style=4))
        facets.append(Facet(np.array(seat), "concrete", texel=0.004, style=5))
    return facets
