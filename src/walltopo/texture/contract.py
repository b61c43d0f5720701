"""Settings of the texture stage."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["TextureSettings"]


@dataclass(frozen=True)
class TextureSettings:
    """How photos become the mesh's picture."""

    size: int = setting(4096, "side of the square texture atlas", unit="px", low=256, high=16384)
    gutter: int = setting(
        3, "pixels that a chart's colours run beyond its border", unit="px", low=1, high=32
    )
    smoothness: float = setting(
        1.0, "preference for large charts over the best photo per triangle", low=0.0, high=20.0
    )
    blend: bool = setting(True, "level exposure between photos and seams between charts")

    def __post_init__(self) -> None:
        check_settings(self, "texture")
