"""Which face of the detailed mesh each pixel of a drawing of the simplified one shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.export.parallel import Axes, render_parallel

__all__ = ["Sight"]

Floats = NDArray[np.float64]

SLACK = 8.0  # mean edges of the detailed mesh that the simplified surface may lie behind it
PASSES = 2  # of leaving out what hides the surface
GRAZING = 0.1  # cosine below which a pixel's depth on a face is not to be trusted


def _depth(mesh: Mesh, number: NDArray[np.int64], at: Floats, axes: Axes) -> Floats:
    """(n,) depth along `axes.towards` of places (n, 2) of the drawing on the planes of their faces.

    NaN where there is no face (-1) or it is seen at a grazing angle.
    """
    depth = np.full(len(number), np.nan)
    there = np.flatnonzero(number >= 0)
    used, own = np.unique(number[there], return_inverse=True)
    normal = mesh.normals[used]
    slope = normal @ axes.towards
    slope[np.abs(slope) < GRAZING] = np.nan
    # A place (u, v) at depth t is u right + v down + t towards; its plane holds corner 0.
    offset = np.einsum("ij,ij->i", normal, mesh.vertices[mesh.faces[used, 0]]) / slope
    across, along = normal @ axes.right / slope, normal @ axes.down / slope
    depth[there] = offset[own] - at[there, 0] * across[own] - at[there, 1] * along[own]
    return depth


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
            return render_parallel(mesh.vertices, mesh.faces[chosen], axes, low, scale, size)[0]

        drawn = np.flatnonzero(part)
        near = seen(self._coarse, drawn)
        row, column = np.nonzero(wanted & (near >= 0))
        at = low + (np.stack([column, row], axis=-1) + 0.5) / scale
        limit = _depth(self._coarse, drawn[near[row, column]], at, axes) - self._slack
        kept = np.flatnonzero(self._detailed.normals @ axes.towards < 0)
        for number in range(PASSES):
            face = seen(self._detailed, kept)
            own = face[row, column]
            with np.errstate(invalid="ignore"):
                before = _depth(self._detailed, np.append(kept, -1)[own], at, axes) < limit
            wrong = np.bincount(own[before], minlength=len(kept))
            hiding = 2 * wrong > np.bincount(own[own >= 0], minlength=len(kept))
            if number == PASSES - 1 or not hiding.any():
                break
            kept = kept[~hiding]
        face[row[before], column[before]] = -1
        return np.append(kept, -1)[face].astype(np.int32)
