"""The scan before any edit: its files, and the snapshot on which edits are replayed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.editing.settings import EditSettings
from walltopo.geometry.rays import TriangleIndex, triangle_index_of
from walltopo.scans.artifacts import of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import LogFiles, ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceTable
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import SceneLight
from walltopo.scans.routes import Routes


@dataclass(frozen=True)
class SnapshotFiles(LogFiles):
    """The artifacts that the stage `edit` and the editor read."""

    mesh: Mesh = of(ScanFolder.mesh)
    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    instances: InstanceTable = of(ScanFolder.instances)
    holds_raw: Holds = of(ScanFolder.holds_raw)
    light: SceneLight = of(ScanFolder.light)
    routes_raw: Routes = of(ScanFolder.routes_raw)


@dataclass(frozen=True, eq=False)
class ScanSnapshot:
    """The scan before any edit; immutable.

    Parameters
    ----------
    labels : (F,) int32, instance of each triangle, 0 = wall.
    numbers : ids of the instances that have triangles.
    """

    mesh: Mesh
    labels: NDArray[np.int32]
    numbers: frozenset[int]
    found: Holds
    routes: Routes
    light: SceneLight
    views: Sequence[View]
    photos: PhotoSet
    settings: EditSettings

    @classmethod
    def of(cls, reads: SnapshotFiles, settings: EditSettings) -> ScanSnapshot:
        """Build the snapshot from artifacts; raise InputError if they belong to different runs."""
        reads.instances.check_fits(reads.mesh)
        return cls(
            mesh=reads.mesh,
            labels=reads.instances.face_instance,
            numbers=frozenset(np.unique(reads.instances.face_instance).tolist()) - {0},
            found=reads.holds_raw,
            routes=reads.routes_raw,
            light=reads.light,
            views=reads.sparse.views,
            photos=reads.photos,
            settings=settings,
        )

    @property
    def metric(self) -> bool:
        """Return whether lengths are metres."""
        return self.found.metric

    @property
    def unit(self) -> float:
        """Return the scan units per metre."""
        return self.found.unit

    @property
    def triangles(self) -> TriangleIndex:
        """Return a spatial index of the mesh's triangles."""
        return triangle_index_of(self.mesh)
