"""The files of a scan that make a wall, and those that its page and report tell of besides."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.scan.artifacts import of
from walltopo.scan.attributes import Attributes
from walltopo.scan.colmap_model import SparseModel
from walltopo.scan.folder import ScanFolder
from walltopo.scan.holds import Holds
from walltopo.scan.instances import InstanceTable, Relabelled
from walltopo.scan.moves import Moves
from walltopo.scan.photos import PhotoList, PhotoSet
from walltopo.scan.pictures import Cutouts, TextureImage, TextureUv
from walltopo.scan.routes import Routes
from walltopo.scan.scale import Scale


@dataclass(frozen=True)
class WallFiles:
    """Enough to write a finished scan in another format."""

    scale: Scale = of(ScanFolder.scale)
    mesh: Mesh = of(ScanFolder.mesh)
    texture: TextureImage = of(ScanFolder.texture)
    texture_uv: TextureUv = of(ScanFolder.texture_uv)
    instances: InstanceTable = of(ScanFolder.instances)
    routes: Routes = of(ScanFolder.routes)
    holds: Holds = of(ScanFolder.holds)
    relabelled: Relabelled | None = of(ScanFolder.relabelled)
    sparse: SparseModel = of(ScanFolder.sparse)


@dataclass(frozen=True)
class PageFiles(WallFiles):
    """The wall, and what page and report tell besides."""

    attributes: Attributes = of(ScanFolder.attributes)
    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    cutouts: Cutouts = of(ScanFolder.cutouts)
    moves: Moves | None = of(ScanFolder.moves)
