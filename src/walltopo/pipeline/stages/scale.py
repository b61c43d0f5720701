"""The stage `scale`: Metres, up and the floor: `work/sparse` to `sparse/` and `scale.json`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Stage
from walltopo.reconstruct.scale.settings import ScaleSettings
from walltopo.scans.artifacts import figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.scale import Aligned, Scale


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse_raw: SparseModel = of(ScanFolder.sparse_raw)
    aligned: Aligned | None = of(ScanFolder.aligned)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)
    metrics: Metrics = figures()


def run(reads: Reads, settings: ScaleSettings, context: Context) -> Writes:
    """Metres, up and the floor: `work/sparse` to `sparse/` and `scale.json`."""
    from walltopo.reconstruct.scale.world_frame import find_world

    return Writes(*find_world(reads.photos, reads.sparse_raw, reads.aligned, settings, context))


SCALE = Stage("scale", Reads, Writes, run, version=2)
