"""The artifacts of both scans that a partial rescan joins, and of the whole wall that it makes."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.scans.artifacts import figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import LogFiles, ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.joined import Joined
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.pictures import Cutouts, SceneLight, TextureImage, TextureUv
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale


@dataclass(frozen=True, eq=False)
class WallFiles:
    """The artifacts of a wall before any edit."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)
    mesh: Mesh = of(ScanFolder.mesh)
    texture: TextureImage = of(ScanFolder.texture)
    texture_uv: TextureUv = of(ScanFolder.texture_uv)
    detections: Detections = of(ScanFolder.detections)
    instances: InstanceTable = of(ScanFolder.instances)
    instance_records: InstanceRecords = of(ScanFolder.instance_records)
    holds_raw: Holds = of(ScanFolder.holds_raw)
    light: SceneLight = of(ScanFolder.light)
    cutouts: Cutouts = of(ScanFolder.cutouts)
    routes_raw: Routes = of(ScanFolder.routes_raw)


@dataclass(frozen=True, eq=False)
class ReferenceFiles(WallFiles, LogFiles):
    """The artifacts of the reference: the wall, its holds after the edits, and the edits."""

    holds: Holds = of(ScanFolder.holds)


@dataclass(frozen=True, eq=False)
class JoinedFiles(WallFiles):
    """The artifacts of the whole wall."""

    joined: Joined | None = of(ScanFolder.joined)
    carried: EditLog | None = of(ScanFolder.carried)
    metrics: Metrics = figures()
