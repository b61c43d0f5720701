"""Settings of the export stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import about, check_settings


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
