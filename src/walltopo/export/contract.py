"""Settings of the export stage."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["ExportSettings"]


@dataclass(frozen=True)
class ExportSettings:
    """How detailed the exported files are."""

    first_triangles: int = setting(
        120_000, "triangles of the tier that the page shows first", low=1_000
    )
    detail_triangles: int = setting(
        400_000, "triangles of the tier that the page streams after it", low=1_000
    )
    archive_triangles: int = setting(
        0, "most triangles in wall.glb; 0 keeps every triangle of the mesh", low=0
    )
    first_texture: int = setting(
        2048, "longest side of the first tier's texture", unit="px", low=64, high=16384
    )
    detail_texture: int = setting(
        4096, "longest side of the detail tier's texture", unit="px", low=64, high=16384
    )
    archive_texture: int = setting(
        8192, "longest side of the texture in wall.glb", unit="px", low=64, high=16384
    )
    texture_quality: int = setting(80, "WebP and JPEG quality", unit="%", low=1, high=100)
    title: str = setting("", "title of the page and the report; empty: the folder's name")
    thumbnails: bool = setting(True, "write hold pictures into the report")

    def __post_init__(self) -> None:
        check_settings(self, "export")
