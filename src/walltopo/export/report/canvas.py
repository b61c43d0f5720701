"""Flat pictures of the wall, from the front and from above, in true proportion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.export.parallel import Axes, axes_towards, render_parallel
from walltopo.export.picture import texels
from walltopo.export.surface import Look

__all__ = ["Canvas", "base_colours", "paper_view"]

Floats = NDArray[np.float64]
PAPER = (245, 246, 248)


@dataclass(frozen=True, eq=False)
class Canvas:
    """A drawing plane: where world points land, and which face each pixel shows.

    Parameters
    ----------
    axes : the picture's directions.
    origin : (2,) plane coordinates of the top-left corner, world units.
    scale : pixels per world unit.
    face : (H, W) int32 face index, -1 = none.
    """

    axes: Axes
    origin: Floats
    scale: float
    face: NDArray[np.int32]

    def place(self, points: Floats) -> Floats:
        """(..., 2) pixels of (..., 3) world points."""
        return (self.axes.flat(points) - self.origin) * self.scale

    def picture(self, face_colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """(H, W, 3) picture with the given (F, 3) colours."""
        table = np.vstack([face_colours, np.array([PAPER], dtype=np.uint8)])
        return table[self.face]


def paper_view(
    positions: Floats, triangles: NDArray[np.int32], towards: Floats, up: Floats, width: int
) -> Canvas:
    """Draw without perspective.

    Parameters
    ----------
    positions : (V, 3), world frame.
    towards : (3,) unit, the direction one looks.
    up : (3,) unit, up in the picture.
    width : pixels; the height follows, at most twice the width.
    """
    axes = axes_towards(towards, up)
    plane = axes.flat(positions)
    low, high = plane.min(axis=0), plane.max(axis=0)
    size = np.maximum(high - low, 1e-6)
    origin = low - 0.04 * size.max()
    extent = size + 0.08 * size.max()
    scale = width / float(extent[0])
    height = int(np.clip(round(extent[1] * scale), 16, 2 * width))
    face = render_parallel(positions, triangles, axes, origin, scale, (width, height))
    return Canvas(axes, origin, scale, face)


def base_colours(look: Look) -> NDArray[np.uint8]:
    """(T, 3) one colour a triangle: of the texture, of the vertices, or shaded grey."""
    surface, corners = look.surface, look.surface.mesh.faces
    if surface.uv is not None and look.picture is not None:
        return texels(look.picture, surface.uv[corners].mean(axis=1))
    if surface.colours is not None:
        return surface.colours[corners].mean(axis=1).astype(np.uint8)
    shade = 130 + 90 * np.abs(surface.normals[corners].mean(axis=1) @ np.array([0.5, 0.4, 0.76]))
    return np.repeat(shade[:, None], 3, axis=1).astype(np.uint8)
