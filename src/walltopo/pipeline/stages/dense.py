"""The stage `dense`: posed photos to one triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.pipeline.stage import Stage
from walltopo.reconstruct.dense.settings import DenseSettings
from walltopo.scans.artifacts import figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.scale import Scale


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    mesh: Mesh = of(ScanFolder.mesh)
    metrics: Metrics = figures()


def check(settings: DenseSettings) -> None:
    """Raise what these settings ask for and this machine lacks."""
    if settings.backend == "colmap":
        from walltopo.reconstruct.dense.external import need_cuda

        need_cuda()
    elif settings.backend == "openmvs":
        from walltopo.reconstruct.openmvs import find_programs

        find_programs(settings.openmvs_bin)


def run(reads: Reads, settings: DenseSettings, context: Context) -> Writes:
    """Posed photos to one triangle mesh."""
    from walltopo.reconstruct.dense.backends import make_mesh

    return Writes(*make_mesh(reads.photos, reads.sparse, reads.scale.metric, settings, context))


DENSE = Stage("dense", Reads, Writes, run, check, version=4)
