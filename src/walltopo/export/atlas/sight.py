"""Which face of the detailed mesh each pixel of a drawing of the simplified one shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.export.parallel import Axes, render_parallel

__all__ = ["Sight", "crosses"]

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]

SLACK = 8.0  # mean edges of the detailed mesh that the simplified surface may lie behind it
PASSES = 2  # of leaving out what hides the surface
GRAZING = 0.1  # cosine below which a pixel's depth on a face is not to be trusted


def crosses(corner: Floats) -> Floats:
    """(n, 3) normals, twice the area long, of (n, 3, 3) triangle corners."""
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def _depth(vertices: Floats, faces: Faces, number: Faces, at: Floats, axes: Axes) -> Floats:
    """(n,) depth along `axes.towards` of places (n, 2) of the drawing on the planes of their faces.

    NaN where there is no face (-1) or it is seen at a grazing angle.
    """
    depth = np.full(len(number), np.nan)
    there = np.flatnonzero(number >= 0)
    used, own = np.unique(number[there], return_inverse=True)
    corner = vertices[faces[used]]
    normal = crosses(corner)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    slope = normal @ axes.towards
    slope[np.abs(slope) < GRAZING * length] = np.nan
    # A place (u, v) at depth t is u right + v down + t towards; its plane holds corner 0.
    offset = np.einsum("ij,ij->i", normal, corner[:, 0]) / slope
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
    vertices, faces : (V, 3) and (F, 3) of the detailed mesh.
    """

    def __init__(self, vertices: Floats, faces: Faces) -> None:
        corner = vertices[faces]
        self._vertices, self._faces = vertices, faces
        self._normals = crosses(corner)
        self._slack = SLACK * float(np.linalg.norm(corner[:, 1] - corner[:, 0], axis=1).mean())

    def faces_on(
        self,
        coarse: tuple[Floats, Faces],
        axes: Axes,
        low: Floats,
        scale: float,
        wanted: NDArray[np.bool_],
    ) -> Faces:
        """The face that lies on the simplified surface at each pixel.

        Parameters
        ----------
        coarse : vertices and faces of the part of it that is drawn from this direction.
        low, scale : see `render_parallel`.
        wanted : (H, W) pixels that matter.

        Returns
        -------
        (H, W) int32, -1 = none.
        """
        size = (wanted.shape[1], wanted.shape[0])
        near, _ = render_parallel(*coarse, axes, low, scale, size)
        row, column = np.nonzero(wanted & (near >= 0))
        at = low + (np.stack([column, row], axis=-1) + 0.5) / scale
        limit = _depth(*coarse, near[row, column], at, axes) - self._slack
        kept = np.flatnonzero(self._normals @ axes.towards < 0)
        for number in range(PASSES):
            faces = self._faces[kept]
            face, _ = render_parallel(self._vertices, faces, axes, low, scale, size)
            own = face[row, column]
            with np.errstate(invalid="ignore"):
                before = _depth(self._vertices, faces, own, at, axes) < limit
            wrong = np.bincount(own[before], minlength=len(kept))
            hiding = 2 * wrong > np.bincount(own[own >= 0], minlength=len(kept))
            if number == PASSES - 1 or not hiding.any():
                break
            kept = kept[~hiding]
        face[row[before], column[before]] = -1
        return np.where(face >= 0, np.append(kept, -1)[face], -1).astype(np.int32)
