"""Settings of the texture stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import about, check_settings


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
