"""The levels of detail of one wall, each a GLB."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import StageError
from walltopo.export.gltf import Packing, write_glb
from walltopo.export.params import ExportSettings
from walltopo.export.picture import encode_texture
from walltopo.export.surface import Surface, mixed_triangles, simplify, split_at_borders
from walltopo.export.wall import Wall

__all__ = ["TIERS", "Tier", "build_tier", "tier_surface"]

WEB = Packing(quantised=True, compressed=True, normals=False)


@dataclass(frozen=True)
class Tier:
    """One level: its file's name, packing and texture format."""

    name: str
    packing: Packing
    picture: str


TIERS = {
    "first": Tier("first", WEB, "WEBP"),
    "detail": Tier("detail", WEB, "WEBP"),
    "archive": Tier("archive", Packing(), "JPEG"),
}


def tier_surface(wall: Wall, triangles: int) -> Surface:
    """The wall's surface with at most about `triangles` triangles (0: all), no mixed ids.

    Raises
    ------
    StageError : a triangle mixes two ids (a fault of the simplifier, never of the input).
    """
    surface = simplify(split_at_borders(wall.mesh, wall.face_instance, wall.uv), triangles)
    mixed = mixed_triangles(surface)
    if mixed:
        raise StageError(f"export: {mixed} triangles mix two holds after simplification")
    return surface


def build_tier(wall: Wall, name: str, settings: ExportSettings) -> tuple[bytes, Surface]:
    """The GLB of one tier (`first`, `detail`, `archive`) and the surface in it."""
    tier = TIERS[name]
    surface = tier_surface(wall, getattr(settings, f"{name}_triangles"))
    picture = None
    if wall.texture is not None:
        longest = getattr(settings, f"{name}_texture")
        picture = encode_texture(wall.texture, longest, tier.picture, settings.texture_quality)
    data = write_glb(
        surface,
        wall.holds,
        wall.routes,
        picture=picture,
        packing=tier.packing,
        metric=wall.metric,
        title=wall.title,
    )
    return data, surface
