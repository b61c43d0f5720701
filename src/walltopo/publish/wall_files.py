"""The artifacts of a scan that make up a wall, and those of its page and report."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.scans.artifacts import of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.hidden import HiddenPlaces
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceTable, Relabelled
from walltopo.scans.moves import Moves
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.pictures import Cutouts, TextureImage, TextureUv
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale


@dataclass(frozen=True)
class WallFiles:
    """The artifacts needed to write a finished scan in another format."""

    scale: Scale = of(ScanFolder.scale)
    mesh: Mesh = of(ScanFolder.mesh)
    texture: TextureImage = of(ScanFolder.texture)
    texture_uv: TextureUv = of(ScanFolder.texture_uv)
    instances: InstanceTable = of(ScanFolder.instances)
    routes: Routes = of(ScanFolder.routes)
    holds: Holds = of(ScanFolder.holds)
    relabelled: Relabelled | None = of(ScanFolder.relabelled)
    hidden: HiddenPlaces | None = of(ScanFolder.hidden)
    sparse: SparseModel = of(ScanFolder.sparse)


@dataclass(frozen=True)
class PageFiles(WallFiles):
    """The artifacts of the wall, its page and its report."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    cutouts: Cutouts = of(ScanFolder.cutouts)
    moves: Moves | None = of(ScanFolder.moves)
