"""Which face of the detailed mesh each pixel of a parallel projection shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.zbuffer import draw_screen

Floats = NDArray[np.float64]

SLACK = 8.0  # mean edges of the detailed mesh that the simplified surface may lie behind it

PASSES = 2  # of leaving out what hides the surface

TILE = 16  # pixels


@kernel
def _in_reach(
    begin: Any, end: Any, faces: Any, screen: Any, slope: Any, tiles: Any, found: Any
) -> None:
    """Set `found` for faces that look at the eye and whose surroundings hold a wanted tile."""
    rows, columns = tiles.shape
    for f in range(begin, end):
        if not slope[f] < 0.0:
            continue
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        left = min(screen[a, 0], screen[b, 0], screen[c, 0]) / TILE
        right = max(screen[a, 0], screen[b, 0], screen[c, 0]) / TILE
        top = min(screen[a, 1], screen[b, 1], screen[c, 1]) / TILE
        bottom = max(screen[a, 1], screen[b, 1], screen[c, 1]) / TILE
        for row in range(int(max(top, 0.0)), int(min(bottom, rows - 1.0)) + 1):
            for column in range(int(max(left, 0.0)), int(min(right, columns - 1.0)) + 1):
                if tiles[row, column]:
                    found[f] = True


def _tiles(wanted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Squares of `TILE` pixels in which some pixel is wanted."""
    across = np.logical_or.reduceat(wanted, np.arange(0, wanted.shape[1], TILE), axis=1)
    return np.logical_or.reduceat(across, np.arange(0, len(wanted), TILE), axis=0)


@kernel
def _count_before(surface: Any, face: Any, near: Any, slack: Any, count: Any) -> Any:
    """(2, count) pixels at which each face is drawn over the surface, and those far before it."""
    counts = np.zeros((2, count), dtype=np.int32)
    for row in range(face.shape[0]):
        for column in range(face.shape[1]):
            if surface[row, column] > 0.0 and face[row, column] >= 0:
                counts[0, face[row, column]] += 1
                if near[row, column] > surface[row, column] + slack:
                    counts[1, face[row, column]] += 1
    return counts


@kernel
def _number(
    begin: Any, end: Any, surface: Any, face: Any, near: Any, slack: Any, numbers: Any
) -> None:
    """Give the faces of a drawing their numbers in the mesh; -1 far before the surface."""
    for row in range(begin, end):
        for column in range(face.shape[1]):
            if face[row, column] >= 0:
                there = surface[row, column]
                hides = there > 0.0 and near[row, column] > there + slack
                face[row, column] = -1 if hides else numbers[face[row, column]]


class Sight:
    """Looks at a detailed mesh from any direction, past what hides the surface that is asked for.

    What stands before that surface is not on it: from below, where an overhang is drawn from, the
    mat would hide the foot of the wall. So only faces that look at the eye are drawn, and those
    that mostly stand before the surface are left out.

    Parameters
    ----------
    detailed, coarse : the mesh that is looked at, and its simplified surface.
    """

    def __init__(self, detailed: Mesh, coarse: Mesh) -> None:
        self._detailed, self._coarse = detailed, coarse
        start, end = (detailed.vertices[detailed.faces[:, k]] for k in range(2))
        self._slack = SLACK * float(np.linalg.norm(end - start, axis=1).mean())

    def faces_on(
        self,
        part: NDArray[np.bool_],
        axes: Axes,
        low: Floats,
        scale: float,
        wanted: NDArray[np.bool_],
    ) -> NDArray[np.int32]:
        """The detailed mesh's face that lies on the simplified surface at each pixel.

        Parameters
        ----------
        part : which faces of the simplified surface are drawn from this direction.
        low, scale : see `on_screen`.
        wanted : (H, W) pixels that matter.

        Returns
        -------
        (H, W) int32, -1 = none.
        """

        height, width = wanted.shape
        coarse, detailed, slack = self._coarse, self._detailed, self._slack * scale
        # The simplified surface has vertices of the detailed one.
        far = float((detailed.vertices @ axes.towards).max()) + 1.0
        screen = on_screen(coarse.vertices, axes, low, scale, far)
        _, surface = draw_screen(screen, coarse.faces[part], width, height)
        surface[~wanted] = 0.0
        screen = on_screen(detailed.vertices, axes, low, scale, far)
        shown = np.zeros(len(detailed.faces), dtype=bool)
        slope, tiles = detailed.normals @ axes.towards, _tiles(wanted)
        in_ranges(_in_reach, len(shown), detailed.faces, screen, slope, tiles, shown)
        kept = np.flatnonzero(shown)
        for number in range(PASSES):
            face, near = draw_screen(screen, detailed.faces[kept], width, height)
            if number == PASSES - 1:
                break
            pixels, before = _count_before(surface, face, near, slack, len(kept))
            hiding = 2 * before > pixels
            if not hiding.any():
                break
            kept = kept[~hiding]
        in_ranges(_number, height, surface, face, near, slack, kept)
        return face


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
    from walltopo.geometry.zbuffer import draw_screen

    far = float((positions @ axes.towards).max(initial=0.0)) + 1.0
    return draw_screen(on_screen(positions, axes, origin, scale, far), triangles, *size)[0]
