"""Pieces of surface that hang in the air: kept in `wall.glb`, left out of the page."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.export.keep import keep_faces
from walltopo.export.wall import Wall
from walltopo.meshes.topology import vertex_parts

__all__ = ["loose_faces", "without_loose"]

# Of the whole surface. A volume that stands apart from its wall is a hold and stays in any case.
LEAST_SHARE = 0.01


def loose_faces(wall: Wall) -> NDArray[np.bool_]:
    """(F,) bool: faces of connected pieces without a hold and under 1 % of the whole surface."""
    faces = wall.mesh.faces
    piece = vertex_parts(faces, len(wall.mesh.vertices))[faces[:, 0]]
    area = np.bincount(piece, wall.mesh.areas)
    held = np.bincount(piece, wall.face_instance > 0) > 0
    loose = (area < LEAST_SHARE * area.sum()) & ~held
    return np.asarray(loose[piece])


def without_loose(wall: Wall) -> Wall:
    """The wall as the page shows it; the same object where nothing is loose."""
    loose = loose_faces(wall)
    if not loose.any():
        return wall
    return keep_faces(wall, ~loose, {hold.id for hold in wall.holds})
