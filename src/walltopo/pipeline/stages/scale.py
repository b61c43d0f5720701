"""Run the stage `scale`: metres, up and floor; `work/sparse` to `sparse/` and `scale.json`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Cost, Stage
from walltopo.reconstruct.settings import ScaleSettings
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.poses import PosesFit
from walltopo.scans.scale import Aligned, Scale


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse_raw: SparseModel = of(ScanFolder.sparse_raw)
    aligned: Aligned | None = of(ScanFolder.aligned)
    poses_fit: PosesFit | None = of(ScanFolder.poses_fit)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)
    metrics: Metrics = figures()


def run(reads: Reads, settings: ScaleSettings, context: Context) -> Writes:
    """Find metres, up and floor; transform the sparse model into the world frame."""
    from walltopo.reconstruct.scale.world_frame import FrameHints, find_world

    hints = FrameHints(reads.aligned, reads.poses_fit)
    return Writes(*find_world(reads.photos, reads.sparse_raw, hints, settings, context))


SCALE = Stage("scale", Reads, Writes, run, version=2, cost=Cost(0.8, 0.025))
