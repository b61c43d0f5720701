"""Run the stage `lift`: 2D masks and the mesh to 3D instances."""

from __future__ import annotations

from dataclasses import dataclass, replace

from walltopo.core import Mesh
from walltopo.pipeline.stage import Cost, Stage
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.manifest import Metrics
from walltopo.scans.scale import Scale
from walltopo.segment.lift.settings import LiftParams


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)
    mesh: Mesh = of(ScanFolder.mesh)
    detections: Detections = of(ScanFolder.detections)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    lifted: InstanceTable = of(ScanFolder.lifted)
    lifted_records: InstanceRecords = of(ScanFolder.lifted_records)
    metrics: Metrics = figures()


def run(reads: Reads, settings: LiftParams, context: Context) -> Writes:
    """Lift the scan's detections onto its mesh.

    A scan without a scale is always lifted with normalised lengths, because its unit is arbitrary.
    """
    import numpy as np

    from walltopo.segment.lift import lift
    from walltopo.segment.lift_files import records_of, table_of

    found = reads.detections
    views = [view.with_masks(found.masks.get(view.name, ())) for view in reads.sparse.views]
    if not reads.scale.metric and not settings.normalised:
        context.progress.note("the scan has no scale, so the lift uses normalised lengths")
        settings = replace(settings, normalised=True)
    instances = lift(reads.mesh, views, settings, context.progress)
    return Writes(
        table_of(instances),
        records_of(instances, views, found.classes),
        {
            "instances": len(instances),
            "masks": sum(len(view.masks) for view in views),
            "views": len(views),
            "faces_labelled": int(np.count_nonzero(instances.face_instance)),
        },
    )


LIFT = Stage("lift", Reads, Writes, run, cost=Cost(18, 0.0))
