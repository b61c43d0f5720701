"""Find the face of the detailed mesh at each pixel of a parallel projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.topology import side_lengths
from walltopo.geometry.zbuffer import draw_screen

Floats = NDArray[np.float64]

SLACK = 8.0  # tolerance in depth, in mean edges of the detailed mesh, between the two surfaces

PASSES = 2  # of removing occluders of the surface

TILE = 16  # pixels


@kernel
def _in_reach(begin: Any, end: Any, faces: Any, screen: Any, tiles: Any, found: Any) -> None:
    """Set `found` for faces that face the viewer and whose bounds contain a wanted tile."""
    rows, columns = tiles.shape
    for f in range(begin, end):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        across = (screen[b, 0] - screen[a, 0]) * (screen[c, 1] - screen[a, 1])
        if not across < (screen[b, 1] - screen[a, 1]) * (screen[c, 0] - screen[a, 0]):
            continue
        left = min(screen[a, 0], screen[b, 0], screen[c, 0]) / TILE
        right = max(screen[a, 0], screen[b, 0], screen[c, 0]) / TILE
        top = min(screen[a, 1], screen[b, 1], screen[c, 1]) / TILE
        bottom = max(screen[a, 1], screen[b, 1], screen[c, 1]) / TILE
        for row in range(int(max(top, 0.0)), int(min(bottom, rows - 1.0)) + 1):
            for column in range(int(max(left, 0.0)), int(min(right, columns - 1.0)) + 1):
                if tiles[row, column]:
                    found[f] = True


def _tiles_of(wanted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the squares of `TILE` pixels that contain a wanted pixel."""
    across = np.logical_or.reduceat(wanted, np.arange(0, wanted.shape[1], TILE), axis=1)
    return np.logical_or.reduceat(across, np.arange(0, len(wanted), TILE), axis=0)


@kernel
def _count_occluding(surface: Any, face: Any, near: Any, slack: Any, count: Any) -> Any:
    """Return (2, count): each face's pixels over the surface, those more than `slack` before."""
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
    """Convert the faces of a rendering to mesh numbers; -1 far in front of the surface."""
    for row in range(begin, end):
        for column in range(face.shape[1]):
            if face[row, column] >= 0:
                there = surface[row, column]
                hides = there > 0.0 and near[row, column] > there + slack
                face[row, column] = -1 if hides else numbers[face[row, column]]


class FaceRenderer:
    """Renders a detailed mesh from any direction, without surface in front of the wanted one.

    An occluder is not part of the wanted surface: from below, the direction of an overhang, the mat
    would hide the foot of the wall. Only faces towards the viewer are therefore rendered, without
    those that lie mostly in front of the surface.

    Parameters
    ----------
    detailed, coarse : the mesh to render, and its simplified surface.
    """

    def __init__(self, detailed: Mesh, coarse: Mesh) -> None:
        self._detailed, self._coarse = detailed, coarse
        self._slack = SLACK * float(side_lengths(detailed).mean())

    def faces_on(
        self,
        part: NDArray[np.bool_],
        axes: Axes,
        low: Floats,
        scale: float,
        wanted: NDArray[np.bool_],
    ) -> NDArray[np.int32]:
        """Return the detailed mesh's face on the simplified surface at each pixel.

        Parameters
        ----------
        part : (F,) the faces of the simplified surface that belong to this direction.
        low, scale : see `to_screen`.
        wanted : (H, W) the pixels to fill.

        Returns
        -------
        (H, W) int32, -1 = none.
        """

        height, width = wanted.shape
        coarse, detailed, slack = self._coarse, self._detailed, self._slack * scale
        # The simplified surface has a subset of the detailed one's vertices.
        far = float((detailed.vertices @ axes.towards).max()) + 1.0
        screen = to_screen(coarse.vertices, axes, low, scale, far)
        _, surface = draw_screen(screen, coarse.faces[part], width, height)
        surface[~wanted] = 0.0
        screen = to_screen(detailed.vertices, axes, low, scale, far)
        shown = np.zeros(len(detailed.faces), dtype=bool)
        in_ranges(_in_reach, len(shown), detailed.faces, screen, _tiles_of(wanted), shown)
        kept = np.flatnonzero(shown)
        for number in range(PASSES):
            face, near = draw_screen(screen, detailed.faces[kept], width, height)
            if number == PASSES - 1:
                break
            pixels, before = _count_occluding(surface, face, near, slack, len(kept))
            hiding = 2 * before > pixels
            if not hiding.any():
                break
            kept = kept[~hiding]
        in_ranges(_number, height, surface, face, near, slack, kept)
        return face


@dataclass(frozen=True, eq=False)
class Axes:
    """The world directions of a drawing plane, unit and orthogonal.

    Parameters
    ----------
    right, down : (3,) the picture's axes.
    towards : (3,) the viewing direction; right x down.
    """

    right: Floats
    down: Floats
    towards: Floats

    def flat(self, points: Floats) -> Floats:
        """Return (..., 2) plane coordinates, world units, of (..., 3) points."""
        return np.stack([points @ self.right, points @ self.down], axis=-1)


def front_direction(mesh: Mesh) -> Floats:
    """Return the (3,) horizontal unit vector that the steep parts of the wall face on average."""
    steep = mesh.normals[:, 2] < 0.8
    total = (mesh.normals * mesh.areas[:, None])[steep, :2].sum(axis=0)
    length = float(np.hypot(*total))
    if length < 1e-9:
        return np.array([0.0, -1.0, 0.0])
    return np.array([*total / length, 0.0])


def axes_towards(towards: Floats, up: Floats) -> Axes:
    """Return the axes of a picture looking `towards`, with `up` as far up as possible."""
    towards = towards / np.linalg.norm(towards)
    right = np.cross(towards, up)
    length = np.linalg.norm(right)
    if length < 1e-6:
        # The view is parallel to `up`: any orthogonal axis works.
        right = np.cross(towards, np.roll(up, 1) + np.array([0.3, 0.1, 0.0]))
        length = np.linalg.norm(right)
    right = right / length
    return Axes(right, np.cross(towards, right), towards)


def to_screen(positions: Floats, axes: Axes, origin: Floats, scale: float, far: float) -> Floats:
    """Return (V, 3) points for `draw_screen`: column, row, and height above a far plane in pixels.

    Parameters
    ----------
    positions : (V, 3).
    origin : (2,) plane coordinates of the picture's top-left corner.
    scale : pixels per world unit.
    far : depth of the far plane along `axes.towards`, world units, behind all points.
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
    """Return the nearest face at each pixel's centre.

    Parameters
    ----------
    origin, scale : see `to_screen`.
    size : width, height in pixels.

    Returns
    -------
    (H, W) int32, -1 = none.
    """
    from walltopo.geometry.zbuffer import draw_screen

    far = float((positions @ axes.towards).max(initial=0.0)) + 1.0
    return draw_screen(to_screen(positions, axes, origin, scale, far), triangles, *size)[0]
