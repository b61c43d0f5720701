"""Which face of the detailed mesh each pixel of a drawing of the simplified one shows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.export.parallel import Axes, render_parallel
from walltopo.kernels import in_ranges, kernel

__all__ = ["Sight"]

Floats = NDArray[np.float64]

SLACK = 8.0  # mean edges of the detailed mesh that the simplified surface may lie behind it
PASSES = 2  # of leaving out what hides the surface
GRAZING = 0.1  # cosine below which a pixel's depth on a face is not to be trusted


def _planes(mesh: Mesh, axes: Axes) -> Floats:
    """(F, 3) depth of each face's plane along `axes.towards` at the drawing's origin, and how much
    less it is to the right and down; NaN where the face is seen at a grazing angle.
    """
    slope = mesh.normals @ axes.towards
    slope[np.abs(slope) < GRAZING] = np.nan
    # A place (u, v) at depth t is u right + v down + t towards; its plane holds corner 0.
    offset = np.einsum("ij,ij->i", mesh.normals, mesh.vertices[mesh.faces[:, 0]]) / slope
    across, along = mesh.normals @ axes.right / slope, mesh.normals @ axes.down / slope
    return np.column_stack([offset, across, along])


@kernel
def _before(
    row: Any, column: Any, near: Any, face: Any, coarse: Any, detailed: Any, low: Any, scale: Any,
    slack: Any,
) -> Any:  # fmt: skip
    """Whether the face at a pixel lies before the surface that is asked for."""
    own, asked = face[row, column], near[row, column]
    if own < 0 or asked < 0:
        return False
    u, v = low[0] + (column + 0.5) / scale, low[1] + (row + 0.5) / scale
    depth = detailed[own, 0] - u * detailed[own, 1] - v * detailed[own, 2]
    limit = coarse[asked, 0] - u * coarse[asked, 1] - v * coarse[asked, 2] - slack
    return depth < limit


@kernel
def _count_before(
    near: Any, face: Any, coarse: Any, detailed: Any, low: Any, scale: Any, slack: Any
) -> Any:
    """(2, F) pixels at which each face is drawn over `near`, and of them those where before it."""
    counts = np.zeros((2, len(detailed)), dtype=np.int32)
    for row in range(near.shape[0]):
        for column in range(near.shape[1]):
            if near[row, column] >= 0 and face[row, column] >= 0:
                counts[0, face[row, column]] += 1
                if _before(row, column, near, face, coarse, detailed, low, scale, slack):
                    counts[1, face[row, column]] += 1
    return counts


@kernel
def _leave_out(
    begin: Any, end: Any, near: Any, face: Any, coarse: Any, detailed: Any, low: Any, scale: Any,
    slack: Any,
) -> None:  # fmt: skip
    """Set pixels of `face` to -1 where what they show lies before `near`."""
    for row in range(begin, end):
        for column in range(near.shape[1]):
            if _before(row, column, near, face, coarse, detailed, low, scale, slack):
                face[row, column] = -1


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
        low, scale : see `render_parallel`.
        wanted : (H, W) pixels that matter.

        Returns
        -------
        (H, W) int32, -1 = none.
        """

        def seen(mesh: Mesh, chosen: NDArray[np.int64]) -> NDArray[np.int32]:
            size = (wanted.shape[1], wanted.shape[0])
            drawn = render_parallel(mesh.vertices, mesh.faces[chosen], axes, low, scale, size)
            # Numbers of the mesh's faces; -1 is the last, and stays.
            return np.append(chosen, -1).astype(np.int32)[drawn]

        near = seen(self._coarse, np.flatnonzero(part))
        near[~wanted] = -1
        kept = np.flatnonzero(self._detailed.normals @ axes.towards < 0)
        planes = _planes(self._coarse, axes), _planes(self._detailed, axes)
        for number in range(PASSES):
            face = seen(self._detailed, kept)
            given = near, face, *planes, low, scale, self._slack
            if number == PASSES - 1:
                break
            shown, before = _count_before(*given)
            hiding = 2 * before > shown
            if not hiding.any():
                break
            kept = kept[~hiding[kept]]
        in_ranges(_leave_out, len(near), *given)
        return face
