"""The stage `classify`: colour, type, shape and cutouts of each instance."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.describe.classify.settings import ClassifySettings
from walltopo.pipeline.stage import Stage
from walltopo.scan.artifacts import figures, of
from walltopo.scan.attributes import RawAttributes
from walltopo.scan.colmap_model import SparseModel
from walltopo.scan.context import Context
from walltopo.scan.folder import ScanFolder
from walltopo.scan.instances import InstanceRecords, InstanceTable
from walltopo.scan.light import SceneLight
from walltopo.scan.manifest import Metrics
from walltopo.scan.photos import PhotoSet
from walltopo.scan.pictures import Cutouts
from walltopo.scan.scale import Scale


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)
    mesh: Mesh = of(ScanFolder.mesh)
    instances: InstanceTable = of(ScanFolder.instances)
    instance_records: InstanceRecords = of(ScanFolder.instance_records)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    attributes_raw: RawAttributes = of(ScanFolder.attributes_raw)
    light: SceneLight = of(ScanFolder.light)
    cutouts: Cutouts = of(ScanFolder.cutouts)
    metrics: Metrics = figures()


def run(reads: Reads, settings: ClassifySettings, context: Context) -> Writes:
    """Colour, type, shape and cutouts of each instance."""
    from walltopo.describe.classify.attributes import Inputs, describe_instances

    inputs = Inputs(
        reads.photos,
        reads.sparse.views,
        reads.scale,
        reads.mesh,
        reads.instances,
        reads.instance_records,
    )
    return Writes(
        *describe_instances(inputs, settings, context.scratch / "cutouts", context.progress)
    )


CLASSIFY = Stage("classify", Reads, Writes, run, version=9)
