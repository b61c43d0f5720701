"""Settings of the dense stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class DenseSettings:
    """How the mesh is made; `backend` chooses the program, the rest shapes its result."""

    backend: Annotated[
        Literal["auto", "sgm", "colmap", "openmvs", "sparse"], about("what makes the mesh")
    ] = "auto"
    edge_length: Annotated[
        float, about("edge length wanted, in metric scans", unit="m", low=0.001, high=0.5)
    ] = 0.008
    edge_pixels: Annotated[
        float,
        about(
            "edge length wanted in unscaled scans, and the least in any, in photo pixels",
            unit="px",
            low=0.5,
            high=50,
            expert=True,
        ),
    ] = 3.0
    max_size: Annotated[
        int, about("longer side of the photos that stereo sees", unit="px", low=200, high=8000)
    ] = 1600
    neighbours: Annotated[
        int, about("stereo partners that each photo chooses", low=1, high=20, expert=True)
    ] = 4
    confirm: Annotated[
        Literal["auto", "always", "never"],
        about(
            "whether another photo's depth must confirm each; auto: in scans of over 12 photos, "
            "and there the depths of a single stereo pair",
            expert=True,
        ),
    ] = "auto"
    min_part: Annotated[
        float,
        about(
            "loose parts smaller than this many metres (or 3 % of the scene) are crumbs",
            low=0,
            expert=True,
        ),
    ] = 0.3
    max_hole: Annotated[
        float,
        about(
            "holes up to this diameter, in metres (or 1 % of the scene), are closed",
            low=0,
            expert=True,
        ),
    ] = 0.1
    max_gap: Annotated[
        float,
        about(
            "gaps up to this width, in metres (or 0.2 % of the scene), are closed, however long",
            low=0,
            high=0.2,
            expert=True,
        ),
    ] = 0.02
    max_guess: Annotated[
        float,
        about(
            "holes that stay open are spanned by a guess up to this diameter, in metres (or 10 % "
            "of the scene a metre), where no photo looks through; 0: none",
            low=0,
            high=10,
        ),
    ] = 1.0
    openmvs_bin: Annotated[
        str, about("folder of the OpenMVS programs; empty: looked up on PATH", program=True)
    ] = ""
    openmvs_refine: Annotated[
        bool,
        about("backend openmvs: also move the vertices until the photos agree (slow)", expert=True),
    ] = False

    def __post_init__(self) -> None:
        check_settings(self, "dense")
