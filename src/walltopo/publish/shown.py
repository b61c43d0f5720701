"""Choose the part of a wall that its page and pictures show; `mesh.ply` and `wall.glb` have all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import vertex_components
from walltopo.publish.coarse_wall import CoarseWall, coarse_wall
from walltopo.publish.surroundings import hand_of, surroundings
from walltopo.publish.wall_data import WallModel, keep_faces, read_wall
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest

# Maximum share of the whole surface of a floating piece. A volume apart from its wall is a hold and
# always stays.
MAX_PIECE_SHARE = 0.01

Bools = NDArray[np.bool_]
Labels = NDArray[np.int32]


def read_shown_wall(scan: ScanFolder) -> WallModel:
    """Return what the page of a finished scan shows of its wall.

    Raises
    ------
    InputError : as in `read_wall`.
    """
    wall = read_wall(scan)
    settings = Manifest.load(scan.manifest).settings.get("export", {})
    coarse = coarse_wall(replace(wall.mesh), wall.face_instance)
    return shown_wall(wall, coarse, all_around=bool(settings.get("surroundings", False)))


def shown_wall(wall: WallModel, coarse: CoarseWall, *, all_around: bool = False) -> WallModel:
    """Return the wall without its surroundings and without small floating pieces.

    Parameters
    ----------
    coarse : the wall's mesh with its holds, simplified.
    all_around : keep them; only small floating pieces are left out.

    Returns
    -------
    The same object if nothing is left out.
    """
    mesh = replace(wall.mesh)  # its areas and normals are freed
    cut = np.zeros(len(mesh.faces), bool) if all_around else _surroundings(wall, coarse, mesh)
    rest = np.flatnonzero(~cut)
    cut[rest[small_pieces(mesh, rest, wall.face_instance)]] = True
    return keep_faces(wall, ~cut, np.unique(wall.face_instance)) if cut.any() else wall


def _surroundings(wall: WallModel, coarse: CoarseWall, mesh: Mesh) -> Bools:
    found = surroundings(coarse, mesh, hand_of(coarse, wall.metric))
    return found & (wall.face_instance == 0)


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
