"""The wall of a scan, as clips of climbers need it: photos to find the camera, and holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.rays import Bvh
from walltopo.reconstruct.landmarks import (
    Landmarks,
    find_landmarks,
    landmarks_basis,
    read_landmarks,
    save_landmarks,
)
from walltopo.reconstruct.localise import Localiser
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.beta.in_view import Floats, WallHolds
from walltopo_climb.beta.refusal import ClipError
from walltopo_climb.wall_files import read_wall

_SAMPLES: Final = 48  # points of a hold's outline
_CANDIDATES: Final = 400
_BEHIND: Final = 0.02  # m, that a point may lie behind the surface in front of it
_MIN_VISIBLE: Final = 0.1  # share of a hold's surface; else the hold is hidden


@dataclass(frozen=True, eq=False)
class ScannedWall:
    """The wall of a scan.

    Parameters
    ----------
    unit : scan units per metre. mesh : in scan units, with face_instance (F,) int32.
    """

    holds: tuple[Hold, ...]
    routes: tuple[Route, ...]
    unit: float
    mesh: Mesh
    face_instance: NDArray[np.int32]
    localiser: Localiser

    @classmethod
    def load(cls, folder: ScanFolder, landmarks: Path | None = None) -> ScannedWall:
        """Return the wall of a scan folder.

        Parameters
        ----------
        landmarks : a file with the landmarks of the scan's photos, which then need not be there. It
            is written if it is missing or of another scan.

        Raises
        ------
        InputError : a file of the scan is missing or damaged.
        """
        holds, routes, unit = read_wall(folder.root)
        mesh = ScanFolder.mesh.load(folder)
        bvh = Bvh(mesh.vertices, mesh.faces)
        photos = _landmarks_of(folder, bvh, landmarks)
        return cls(holds, routes, unit, mesh, _labels_of(folder), Localiser(photos, bvh))

    def holds_seen_from(self, eye: Floats) -> WallHolds:
        """Return the holds that a camera sees, in metres, as points of their visible surface.

        Parameters
        ----------
        eye : (3,) m, the camera's centre. A hold of which a tenth is visible counts.
        """
        ids, surfaces, volumes = [], [], []
        for hold in self.holds:
            points = self._visible(hold.id, eye * self.unit)
            if points is None:
                continue
            ids.append(hold.id)
            surfaces.append(points / self.unit)
            volumes.append(hold.kind == "volume")
        if not ids:
            raise ClipError("other-wall", "no hold of the wall is in the picture")
        return WallHolds(np.array(ids), np.array(surfaces), np.array(volumes))

    def _visible(self, hold: int, eye: Floats) -> Floats | None:
        """Return (K, 3) points of a hold that the eye sees, in scan units, or None."""
        faces = np.flatnonzero(self.face_instance == hold)
        if len(faces) == 0:
            return None
        chosen = faces[np.linspace(0, len(faces) - 1, min(len(faces), _CANDIDATES)).astype(int)]
        centres = self.mesh.centroids[chosen]
        ways = centres - eye
        _, along = self.localiser.bvh.first_hit(np.broadcast_to(eye, ways.shape), ways)
        gap = (1 - along) * np.linalg.norm(ways, axis=1)
        faces_eye = np.einsum("ij,ij->i", self.mesh.normals[chosen], ways) < 0
        seen = centres[faces_eye & (gap < _BEHIND * self.unit)]
        if len(seen) < max(1, _MIN_VISIBLE * len(centres)):
            return None
        return seen[np.linspace(0, len(seen) - 1, _SAMPLES).astype(int)]


def _landmarks_of(folder: ScanFolder, bvh: Bvh, kept: Path | None) -> tuple[Landmarks, ...]:
    basis = landmarks_basis(folder)
    found = None if kept is None else read_landmarks(kept, basis)
    if found is None:
        photos = ScanFolder.photos.load(folder)
        views = ScanFolder.sparse.load(folder).views
        found = find_landmarks(views, bvh, photos.read_rgb, photos.people_mask)
        if kept is not None:
            save_landmarks(kept, found, basis)
    return found


def _labels_of(folder: ScanFolder) -> NDArray[np.int32]:
    """Return the hold of each triangle, with the setter's corrections."""
    labels = ScanFolder.instances.load(folder).face_instance
    changed = ScanFolder.relabelled.load(folder)
    return labels if changed is None else changed.on(labels)
