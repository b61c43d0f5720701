"""Pieces of surface that hang in the air: kept in `wall.glb`, left out of the page."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.export.keep import keep_faces
from walltopo.export.wall import Wall
from walltopo.meshes.topology import vertex_parts

__all__ = ["Pieces", "loose_faces", "without_loose"]

# Of the whole surface. A volume that stands apart from its wall is a hold and stays in any case.
LEAST_SHARE = 0.01


def loose_faces(wall: Wall) -> NDArray[np.bool_]:
    """(F,) bool: faces of connected pieces without a hold and under 1 % of the whole surface."""
    return Pieces(wall.mesh).loose(wall.face_instance)


class Pieces:
    """The connected pieces of a mesh."""

    def __init__(self, mesh: Mesh) -> None:
        self._piece = vertex_parts(mesh.faces, len(mesh.vertices))[mesh.faces[:, 0]]
        area = np.bincount(self._piece, mesh.areas)
        self._small = area < LEAST_SHARE * area.sum()

    def loose(self, labels: NDArray[np.int32]) -> NDArray[np.bool_]:
        """(F,) bool: faces of small pieces without a hold."""
        held = np.bincount(self._piece, labels > 0) > 0
        return np.asarray((self._small & ~held)[self._piece])


def without_loose(wall: Wall) -> Wall:
    """The wall as the page shows it; the same object where nothing is loose."""
    loose = loose_faces(wall)
    if not loose.any():
        return wall
    return keep_faces(wall, ~loose, {hold.id for hold in wall.holds})
