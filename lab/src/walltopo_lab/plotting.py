"""Small charts as PNG: lines, points and bars, drawn with Pillow.

A charting library would be the largest dependency of the package for a handful of pictures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from walltopo.core.files import atomic_path

__all__ = ["SERIES_COLOURS", "Axis", "Chart", "write_charts"]

# Okabe & Ito: told apart by people who do not see all colours.
SERIES_COLOURS = (
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (204, 121, 167),
    (86, 180, 233),
    (230, 159, 0),
)
_SIZE = (560, 400)
_MARGIN = (64, 34, 18, 50)  # left, top, right, bottom
_INK, _GRID = (40, 40, 40), (225, 225, 225)


@dataclass(frozen=True)
class Axis:
    """One axis: its words and what it spans."""

    title: str
    low: float
    high: float


def _ticks(low: float, high: float) -> list[float]:
    step = 10 ** math.floor(math.log10(max(high - low, 1e-12)))
    if (high - low) / step < 2.5:
        step /= 5
    elif (high - low) / step < 6:
        step /= 2
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


class Chart:
    """One panel; coordinates are in the units of its axes."""

    def __init__(self, title: str, x: Axis, y: Axis) -> None:
        self._x, self._y = x, y
        self.image = Image.new("RGB", _SIZE, (255, 255, 255))
        self._draw = ImageDraw.Draw(self.image)
        self._font = ImageFont.load_default(12)
        self._legend = 0
        self._frame(title)

    def _frame(self, title: str) -> None:
        left, top, right, bottom = self._area()
        for value in _ticks(self._x.low, self._x.high):
            px, _ = self._at(value, self._y.low)
            self._draw.line([px, top, px, bottom], fill=_GRID)
            self._text((px, bottom + 4), f"{value:.4g}", "ma")
        for value in _ticks(self._y.low, self._y.high):
            _, py = self._at(self._x.low, value)
            self._draw.line([left, py, right, py], fill=_GRID)
            self._text((left - 6, py), f"{value:.4g}", "rm")
        self._draw.rectangle([left, top, right, bottom], outline=_INK)
        self._draw.text((left, 8), title, fill=_INK, font=ImageFont.load_default(15))
        self._text(((left + right) / 2, _SIZE[1] - 22), self._x.title, "ma")
        self._text((4, top - 16), self._y.title, "la")

    def _area(self) -> tuple[float, float, float, float]:
        left, top, right, bottom = _MARGIN
        return left, top + 12, _SIZE[0] - right, _SIZE[1] - bottom

    def _at(self, x: float, y: float) -> tuple[float, float]:
        left, top, right, bottom = self._area()
        u = (x - self._x.low) / max(self._x.high - self._x.low, 1e-12)
        v = (y - self._y.low) / max(self._y.high - self._y.low, 1e-12)
        return left + u * (right - left), bottom - v * (bottom - top)

    def _text(self, at: tuple[float, float], text: str, anchor: str) -> None:
        self._draw.text(at, text, fill=_INK, font=self._font, anchor=anchor)

    def line(self, x: Sequence[float], y: Sequence[float], name: str, series: int = 0) -> None:
        """A line through points, named in the legend."""
        colour = SERIES_COLOURS[series % len(SERIES_COLOURS)]
        points = [self._at(a, b) for a, b in zip(x, y, strict=True)]
        if len(points) > 1:
            self._draw.line(points, fill=colour, width=2)
        self._name(name, colour)

    def points(self, x: Sequence[float], y: Sequence[float], name: str, series: int = 0) -> None:
        """Dots, named in the legend."""
        colour = SERIES_COLOURS[series % len(SERIES_COLOURS)]
        for a, b in zip(x, y, strict=True):
            px, py = self._at(a, b)
            self._draw.ellipse([px - 3, py - 3, px + 3, py + 3], fill=colour)
        self._name(name, colour)

    def bars(self, edges: Sequence[float], heights: Sequence[float]) -> None:
        """A histogram: n + 1 edges, n heights."""
        for k, height in enumerate(heights):
            x0, y0 = self._at(edges[k], height)
            x1, y1 = self._at(edges[k + 1], 0.0)
            self._draw.rectangle([x0 + 1, y0, x1 - 1, y1], fill=SERIES_COLOURS[0])

    def _name(self, name: str, colour: tuple[int, int, int]) -> None:
        if not name:
            return
        _, _, right, _ = self._area()
        y = self._area()[1] + 8 + 17 * self._legend
        self._text((right - 26, y), name, "rt")
        self._draw.line([right - 22, y + 7, right - 6, y + 7], fill=colour, width=3)
        self._legend += 1


def write_charts(path: Path, charts: Sequence[Chart], columns: int = 2) -> None:
    """Write charts side by side as one PNG; atomic."""
    rows = math.ceil(len(charts) / columns)
    columns = min(columns, len(charts))
    sheet = np.full((rows * _SIZE[1], columns * _SIZE[0], 3), 255, dtype=np.uint8)
    for k, chart in enumerate(charts):
        y, x = (k // columns) * _SIZE[1], (k % columns) * _SIZE[0]
        sheet[y : y + _SIZE[1], x : x + _SIZE[0]] = np.asarray(chart.image)
    with atomic_path(path) as temporary:
        Image.fromarray(sheet).save(temporary, format="PNG")
