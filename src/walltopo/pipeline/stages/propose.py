"""Run the stage `propose`: further instances from the relief and colour of the mesh."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.pipeline.stage import Cost, Stage
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.scale import Scale
from walltopo.segment.settings import ProposeSettings


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)
    mesh: Mesh = of(ScanFolder.mesh)
    detections: Detections = of(ScanFolder.detections)
    lifted: InstanceTable = of(ScanFolder.lifted)
    lifted_records: InstanceRecords = of(ScanFolder.lifted_records)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    instances: InstanceTable = of(ScanFolder.instances)
    instance_records: InstanceRecords = of(ScanFolder.instance_records)
    metrics: Metrics = figures()


def run(reads: Reads, settings: ProposeSettings, context: Context) -> Writes:
    """Add instances that the mesh shows but the masks lack."""
    from walltopo.segment.propose.proposals import propose

    return Writes(
        *propose(
            reads.lifted,
            reads.lifted_records,
            reads.mesh,
            reads.detections,
            reads.sparse.views,
            reads.photos,
            reads.scale.metric,
            settings,
            context.progress,
        )
    )


PROPOSE = Stage(
    "propose", Reads, Writes, run, version=2, models=("evidence.json",), cost=Cost(8, 0.05)
)
