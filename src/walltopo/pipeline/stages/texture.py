"""The stage `texture`: photos onto the mesh, as one atlas."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.pipeline.stage import Stage
from walltopo.reconstruct.texture.settings import TextureSettings
from walltopo.scans.artifacts import figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import TextureImage, TextureUv


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    mesh: Mesh = of(ScanFolder.mesh)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    texture: TextureImage = of(ScanFolder.texture)
    texture_uv: TextureUv = of(ScanFolder.texture_uv)
    metrics: Metrics = figures()


def check(settings: TextureSettings) -> None:
    """Raise what these settings ask for and this machine lacks."""
    if settings.backend == "openmvs":
        from walltopo.reconstruct.openmvs import find_programs

        find_programs(settings.openmvs_bin)


def run(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Photos onto the mesh, as one atlas."""
    from walltopo.reconstruct.texture.painting import paint_mesh

    return Writes(*paint_mesh(reads.photos, reads.sparse, reads.mesh, settings, context))


TEXTURE = Stage("texture", Reads, Writes, run, check, version=2)
