"""Run the stage `sparse`: photos to cameras and points, by COLMAP."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Cost, Stage
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.poses import GivenPoses, PosesFit
from walltopo.scans.scale import Aligned


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    poses: GivenPoses | None = of(ScanFolder.poses)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    sparse_raw: SparseModel = of(ScanFolder.sparse_raw)
    aligned: Aligned | None = of(ScanFolder.aligned)
    poses_fit: PosesFit | None = of(ScanFolder.poses_fit)
    metrics: Metrics = figures()


def run(reads: Reads, settings: SparseSettings, context: Context) -> Writes:
    """Register the photos with COLMAP; return cameras and points."""
    from walltopo.reconstruct.sparse.mapping import map_photos

    return Writes(*map_photos(reads.photos, reads.photo_list, reads.poses, settings, context))


MODELS = ("xfeat.onnx", "lighterglue.onnx")
SPARSE = Stage("sparse", Reads, Writes, run, models=MODELS, cost=Cost(0.0, 0.324, 0.038))
