"""Settings of the export stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import Mesh, about, check_settings
from walltopo.scans.attributes import Attributes
from walltopo.scans.cutouts import Cutouts
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceTable
from walltopo.scans.made import Made
from walltopo.scans.manifest import Metrics
from walltopo.scans.model import SparseModel
from walltopo.scans.moves import Moves
from walltopo.scans.photo_list import PhotoList
from walltopo.scans.photo_set import PhotoSet
from walltopo.scans.relabelled import Relabelled
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale
from walltopo.scans.texture import TextureImage, TextureUv

__all__ = ["ExportSettings", "Reads", "WallReads", "Writes"]


@dataclass(frozen=True)
class ExportSettings:
    """How detailed the exported files are."""

    first_triangles: Annotated[
        int, about("triangles of the tier that the page shows first", low=1_000)
    ] = 120_000
    detail_triangles: Annotated[
        int, about("triangles of the tier that the page streams after it", low=1_000)
    ] = 400_000
    archive_triangles: Annotated[
        int, about("most triangles in wall.glb; 0 keeps every triangle of the mesh", low=0)
    ] = 0
    first_texture: Annotated[
        int,
        about(
            "longest side of the first tier's texture", unit="px", low=64, high=16384, expert=True
        ),
    ] = 2048
    detail_texture: Annotated[
        int,
        about(
            "longest side of the detail tier's texture", unit="px", low=64, high=16384, expert=True
        ),
    ] = 4096
    archive_texture: Annotated[
        int,
        about(
            "longest side of the texture in wall.glb", unit="px", low=64, high=16384, expert=True
        ),
    ] = 8192
    title: Annotated[str, about("title of the page and the report; empty: the folder's name")] = ""

    def __post_init__(self) -> None:
        check_settings(self, "export")


@dataclass(frozen=True)
class WallReads:
    """What makes a wall: enough to write a finished scan in another format."""

    scale: Scale
    mesh: Mesh
    texture: TextureImage
    texture_uv: TextureUv
    instances: InstanceTable
    routes: Routes
    holds: Holds
    relabelled: Relabelled | None
    sparse: SparseModel


@dataclass(frozen=True)
class Reads(WallReads):
    """What the stage is given: the wall, and what page and report tell besides."""

    attributes: Attributes
    photos: PhotoSet
    photo_list: PhotoList
    cutouts: Cutouts
    moves: Moves | None


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    glb: Made
    page_assets: Made
    page: Made
    report: Made
    metrics: Metrics
