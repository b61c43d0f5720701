"""Run the stage `dense`: posed photos to one triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from walltopo.core import InputError, Mesh
from walltopo.pipeline.stage import Cost, Stage
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.pictures import TextureImage, TextureUv
from walltopo.scans.poses import GivenPoses
from walltopo.scans.scale import Scale


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    poses: GivenPoses | None = of(ScanFolder.poses)
    sparse: SparseModel = of(ScanFolder.sparse)
    scale: Scale = of(ScanFolder.scale)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    mesh: Mesh = of(ScanFolder.mesh)
    given_texture: TextureImage | None = of(ScanFolder.given_texture)
    given_uv: TextureUv | None = of(ScanFolder.given_uv)
    metrics: Metrics = figures()


def check(settings: DenseSettings) -> None:
    """Raise EnvironmentLacksError if this machine lacks what the settings need.

    Raises
    ------
    InputError : the ready mesh is missing, or no installed package has the backend.
    """
    if settings.mesh:
        if not Path(settings.mesh).is_file():
            raise InputError(f"{settings.mesh}: no such file", "Give the mesh again by --mesh.")
    elif settings.backend != "auto":
        from walltopo.reconstruct.dense.backend import open_backend

        open_backend(settings.backend, settings).check()


def run(reads: Reads, settings: DenseSettings, context: Context) -> Writes:
    """Compute one triangle mesh from posed photos."""
    from walltopo.reconstruct.dense.make_mesh import edge_and_unit, make_mesh

    metric = reads.scale.metric
    if not settings.mesh:
        mesh, figures = make_mesh(reads.photos, reads.sparse, metric, settings, context)
        return Writes(mesh, None, None, figures)
    from walltopo.reconstruct.dense.given_mesh import place_mesh
    from walltopo.reconstruct.dense.scene import read_scene

    if reads.poses is None:
        raise InputError(f"{settings.mesh}: needs the poses of the photos", "Give --poses too.")
    scene = read_scene(reads.sparse.folder)
    edge, _ = edge_and_unit(scene, settings, metric)
    people = bool(reads.photos.people.photos)
    given = place_mesh(scene, reads.poses, reads.photo_list, people, edge, settings, context)
    return Writes(given.mesh, given.picture, given.uv, given.metrics)


DENSE = Stage("dense", Reads, Writes, run, check, version=4, cost=Cost(24, 1.65))
