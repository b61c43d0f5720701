"""The stage `sparse`: photos to cameras and points, by COLMAP."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Stage
from walltopo.reconstruct.sparse.settings import SparseSettings
from walltopo.scans.artifacts import figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.scale import Aligned


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    sparse_raw: SparseModel = of(ScanFolder.sparse_raw)
    aligned: Aligned | None = of(ScanFolder.aligned)
    metrics: Metrics = figures()


def run(reads: Reads, settings: SparseSettings, context: Context) -> Writes:
    """Photos to cameras and points, by COLMAP."""
    from walltopo.reconstruct.sparse.mapping import map_photos

    return Writes(*map_photos(reads.photos, reads.photo_list, settings, context))


SPARSE = Stage("sparse", Reads, Writes, run)
