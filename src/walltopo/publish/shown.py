"""Choose the part of a wall that its page and pictures show; `mesh.ply` and `wall.glb` have all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import vertex_components
from walltopo.publish.coarse_wall import CoarseWall
from walltopo.publish.surroundings import hand_of, surroundings
from walltopo.publish.wall_data import WallModel, keep_faces

# Maximum share of the whole surface of a floating piece. A volume apart from its wall is a hold and
# always stays.
MAX_PIECE_SHARE = 0.01

Bools = NDArray[np.bool_]
Labels = NDArray[np.int32]


def shown_faces(wall: WallModel, coarse: CoarseWall, *, all_around: bool = False) -> Bools:
    """Return (F,) the faces of a wall without its surroundings and small floating pieces.

    Parameters
    ----------
    coarse : the wall's mesh with its holds, simplified.
    all_around : keep the surroundings; only small floating pieces are left out.
    """
    mesh = replace(wall.mesh)  # its areas and normals are freed
    shown = np.ones(len(mesh.faces), dtype=bool)
    if not all_around:
        cut = surroundings(coarse, mesh, hand_of(coarse, wall.metric))
        shown = ~cut | (wall.face_instance > 0)
    rest = np.flatnonzero(shown)
    shown[rest[small_pieces(mesh, rest, wall.face_instance)]] = False
    return shown


def part_shown(wall: WallModel, shown: Bools) -> WallModel:
    """Return the wall with only these faces and all of its holds; the same object if all are."""
    return wall if shown.all() else keep_faces(wall, shown, np.unique(wall.face_instance))


def small_pieces(mesh: Mesh, rows: NDArray[np.int64], labels: Labels) -> Bools:
    """Return (n,) which of these triangles belong to small components without a hold.

    Parameters
    ----------
    rows : (n,) faces of the mesh; labels : (F,) hold ids, 0 = wall.
    """
    faces = mesh.faces[rows]
    piece = vertex_components(faces, len(mesh.vertices))[faces[:, 0]]
    area = np.bincount(piece, mesh.areas[rows])
    small = area < MAX_PIECE_SHARE * area.sum()
    held = np.bincount(piece, labels[rows] > 0) > 0
    return np.asarray((small & ~held)[piece])
