"""Run the stage `classify`: colour, type, shape and cutouts of each instance."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.describe.settings import ClassifySettings
from walltopo.pipeline.stage import Cost, Stage
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import Cutouts, SceneLight
from walltopo.scans.scale import Scale


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)
    mesh: Mesh = of(ScanFolder.mesh)
    instances: InstanceTable = of(ScanFolder.instances)
    instance_records: InstanceRecords = of(ScanFolder.instance_records)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    holds_raw: Holds = of(ScanFolder.holds_raw)
    light: SceneLight = of(ScanFolder.light)
    cutouts: Cutouts = of(ScanFolder.cutouts)
    metrics: Metrics = figures()


def check(settings: ClassifySettings) -> None:
    """Open the classifier that the settings name, so that a bad model fails early."""
    if settings.model:
        from walltopo.describe.classify.attributes import classifier_of

        classifier_of(settings)


def run(reads: Reads, settings: ClassifySettings, context: Context) -> Writes:
    """Describe the colour, type, shape and cutouts of each instance."""
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


MODELS = ("hold_types.onnx", "two_colours.onnx")
CLASSIFY = Stage(
    "classify", Reads, Writes, run, check, version=11, models=MODELS, cost=Cost(0.6, 0.98)
)
