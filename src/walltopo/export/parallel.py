"""Drawing a mesh without perspective: which face each pixel of a flat map shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh

__all__ = ["Axes", "axes_towards", "front_direction", "on_screen", "render_parallel"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Axes:
    """World directions of a drawing plane, unit and at right angles.

    Parameters
    ----------
    right, down : (3,) the picture's axes.
    towards : (3,) the direction one looks; right x down.
    """

    right: Floats
    down: Floats
    towards: Floats

    def flat(self, points: Floats) -> Floats:
        """(..., 2) plane coordinates, world units, of (..., 3) points."""
        return np.stack([points @ self.right, points @ self.down], axis=-1)


def front_direction(mesh: Mesh) -> Floats:
    """(3,) horizontal unit vector that the steep parts of the wall face on average."""
    steep = mesh.normals[:, 2] < 0.8
    total = (mesh.normals * mesh.areas[:, None])[steep, :2].sum(axis=0)
    length = float(np.hypot(*total))
    if length < 1e-9:
        return np.array([0.0, -1.0, 0.0])
    return np.array([*total / length, 0.0])


def axes_towards(towards: Floats, up: Floats) -> Axes:
    """Axes of a picture looking `towards` with `up` as far up as that allows."""
    towards = towards / np.linalg.norm(towards)
    right = np.cross(towards, up)
    length = np.linalg.norm(right)
    if length < 1e-6:
        # Looking straight along `up`: any right angle will do.
        right = np.cross(towards, np.roll(up, 1) + np.array([0.3, 0.1, 0.0]))
        length = np.linalg.norm(right)
    right = right / length
    return Axes(right, np.cross(towards, right), towards)


def on_screen(positions: Floats, axes: Axes, origin: Floats, scale: float, far: float) -> Floats:
    """(V, 3) points as `draw_screen` wants them: column, row, and pixels before a plane.

    Parameters
    ----------
    positions : (V, 3).
    origin : (2,) plane coordinates of the picture's top-left corner.
    scale : pixels per world unit.
    far : depth of that plane along `axes.towards`, world units, behind all points.
    """
    screen = positions @ (np.stack([axes.right, axes.down, -axes.towards]) * scale).T
    screen += scale * np.append(-origin, far)
    return screen


def render_parallel(
    positions: Floats,
    triangles: NDArray[np.int32],
    axes: Axes,
    origin: Floats,
    scale: float,
    size: tuple[int, int],
) -> NDArray[np.int32]:
    """The nearest face at each pixel's centre.

    Parameters
    ----------
    origin, scale : see `on_screen`.
    size : width, height in pixels.

    Returns
    -------
    (H, W) int32, -1 = none.
    """
    from walltopo.raycast import draw_screen

    far = float((positions @ axes.towards).max(initial=0.0)) + 1.0
    return draw_screen(on_screen(positions, axes, origin, scale, far), triangles, *size)[0]
