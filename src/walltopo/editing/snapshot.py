"""The scan before any edit: its files, and what edits are replayed on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.editing.settings import EditSettings
from walltopo.geometry.triangle_index import Triangles, triangles_of_mesh
from walltopo.scans.artifacts import of
from walltopo.scans.attributes import RawAttributes
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.light import SceneLight
from walltopo.scans.photos import PhotoSet
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale


@dataclass(frozen=True)
class SnapshotFiles:
    """What the stage `edit` and the editor read."""

    mesh: Mesh = of(ScanFolder.mesh)
    scale: Scale = of(ScanFolder.scale)
    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    instances: InstanceTable = of(ScanFolder.instances)
    instance_records: InstanceRecords = of(ScanFolder.instance_records)
    attributes_raw: RawAttributes = of(ScanFolder.attributes_raw)
    light: SceneLight = of(ScanFolder.light)
    routes_raw: Routes = of(ScanFolder.routes_raw)
    edits: EditLog | None = of(ScanFolder.edits)


@dataclass(frozen=True, eq=False)
class ScanSnapshot:
    """What the scan found, before any edit; nothing of it is ever changed.

    Parameters
    ----------
    labels : (F,) int32, instance of each triangle, 0 = wall.
    scores : instance id to its score.
    unit : scan units a metre.
    """

    mesh: Mesh
    labels: NDArray[np.int32]
    scores: Mapping[int, float]
    found: RawAttributes
    routes: Routes
    light: SceneLight
    views: Sequence[View]
    photos: PhotoSet
    metric: bool
    unit: float
    settings: EditSettings

    @classmethod
    def of(cls, reads: SnapshotFiles, settings: EditSettings) -> ScanSnapshot:
        """From what the stage is given; InputError where its files are of different runs."""
        reads.instances.check_fits(reads.mesh)
        return cls(
            mesh=reads.mesh,
            labels=reads.instances.face_instance,
            scores={record.id: record.surety for record in reads.instance_records.instances},
            found=reads.attributes_raw,
            routes=reads.routes_raw,
            light=reads.light,
            views=reads.sparse.views,
            photos=reads.photos,
            metric=reads.scale.metric,
            unit=reads.attributes_raw.unit,
            settings=settings,
        )

    @property
    def triangles(self) -> Triangles:
        """Where its triangles are."""
        return triangles_of_mesh(self.mesh)
