"""Settings of the stage `export`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class ExportSettings:
    """Settings of the detail of the exported files."""

    # fmt: off
    first_triangles: Annotated[int, about("Triangles of the tier that the page shows first", low=1000, expert=True)] = 120000
    detail_triangles: Annotated[int, about("Triangles of the tier that the page loads next", low=1000, expert=True)] = 400000
    archive_triangles: Annotated[int, about("Maximum number of triangles in wall.glb; 0 keeps all", low=0, expert=True)] = 0
    first_texture: Annotated[int, about("Longer side of the first tier's texture", unit="px", low=64, high=16384, expert=True)] = 2048
    detail_texture: Annotated[int, about("Longer side of the detail tier's texture", unit="px", low=64, high=16384, expert=True)] = 4096
    archive_texture: Annotated[int, about("Longer side of the texture in wall.glb", unit="px", low=64, high=16384, expert=True)] = 8192
    surroundings: Annotated[bool, about("The page and pictures also show what is around the climbing wall: floor, ceiling, room", expert=True)] = False
    ar_files: Annotated[bool, about("Also page/ar.usdz and page/ar.glb, by which a phone shows the wall in a room", expert=True)] = False
    title: Annotated[str, about("Title of the page and the report; empty: the folder's name")] = ""
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "export")
