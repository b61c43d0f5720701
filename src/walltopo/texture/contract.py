"""Settings of the texture stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import Mesh, about, check_settings
from walltopo.scans.manifest import Metrics
from walltopo.scans.model import SparseModel
from walltopo.scans.photo_set import PhotoSet
from walltopo.scans.texture import TextureImage, TextureUv

__all__ = ["Reads", "TextureSettings", "Writes", "check"]


@dataclass(frozen=True)
class TextureSettings:
    """How photos become the mesh's picture."""

    backend: Annotated[
        Literal["embedded", "openmvs"],
        about("what paints: walltopo itself, or OpenMVS's TextureMesh"),
    ] = "embedded"
    size: Annotated[
        int, about("side of the square texture atlas", unit="px", low=256, high=16384)
    ] = 4096
    blend: Annotated[
        bool, about("level exposure between photos and seams between charts", expert=True)
    ] = True
    openmvs_bin: Annotated[
        str,
        about(
            "folder of the OpenMVS programs; empty: looked up on PATH", program=True, expert=True
        ),
    ] = ""

    def __post_init__(self) -> None:
        check_settings(self, "texture")


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    photos: PhotoSet
    sparse: SparseModel
    mesh: Mesh


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    texture: TextureImage
    texture_uv: TextureUv
    metrics: Metrics


def check(settings: TextureSettings) -> None:
    """Raise what these settings want and this machine lacks, before the first stage begins."""
    if settings.backend == "openmvs":
        from walltopo.openmvs.programs import find_programs

        find_programs(settings.openmvs_bin)
