"""Drawing a mesh without perspective: which face each pixel of a flat map shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh

__all__ = ["Axes", "axes_towards", "front_direction", "render_parallel"]

Floats = NDArray[np.float64]
FAR = 2000.0  # distance of the drawing camera in wall sizes: as good as parallel rays


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
    origin : (2,) plane coordinates of the picture's top-left corner.
    scale : pixels per world unit.
    size : width, height in pixels.

    Returns
    -------
    (H, W) int32, -1 = none.
    """
    from walltopo.raycast import render_ids

    middle = float((positions @ axes.towards).mean())
    distance = FAR * float(np.ptp(positions, axis=0).max() + 1e-6)
    # A camera far away whose ray through the corner pixel starts at `origin`. From so far away
    # depth is too coarse to be of use.
    rotation = np.stack([axes.right, axes.down, axes.towards])
    camera = Camera("SIMPLE_PINHOLE", *size, (scale * distance, 0.0, 0.0))
    pose = np.column_stack([rotation, [-origin[0], -origin[1], distance - middle]])
    return render_ids(positions, triangles, camera, pose)[0]
