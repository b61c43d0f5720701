"""Settings of the dense stage."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["BACKENDS", "DenseSettings"]

BACKENDS = ("auto", "sgm", "colmap", "openmvs", "sparse")


@dataclass(frozen=True)
class DenseSettings:
    """How the mesh is made; `backend` chooses the program, the rest shapes its result."""

    backend: str = setting("auto", "what makes the mesh", choices=BACKENDS)
    edge_length: float = setting(
        0.008, "edge length wanted, in metric scans", unit="m", low=0.001, high=0.5
    )
    edge_pixels: float = setting(
        3.0,
        "edge length wanted in unscaled scans, and the least in any, in photo pixels on the wall",
        unit="px",
        low=0.5,
        high=50,
    )
    max_size: int = setting(
        1600, "longer side of the photos that stereo sees", unit="px", low=200, high=8000
    )
    neighbours: int = setting(4, "stereo partners that each photo chooses", low=1, high=20)
    best_angle_deg: float = setting(
        9.0, "triangulation angle that stereo partners should have", unit="deg", low=1, high=40
    )
    agree: int = setting(2, "stereo pairs that must agree on a depth (fewer if fewer exist)", low=1)
    confirm: str = setting(
        "auto",
        "whether another photo's depth must confirm each depth; auto: in scans of over 12 photos, "
        "and there the depths of a single stereo pair",
        choices=("auto", "always", "never"),
    )
    min_part: float = setting(
        0.3, "loose parts smaller than this many metres (or 3 % of the scene) are crumbs", low=0
    )
    max_hole: float = setting(
        0.1, "holes up to this diameter, in metres (or 1 % of the scene), are closed", low=0
    )
    max_gap: float = setting(
        0.02,
        "gaps up to this width, in metres (or 0.2 % of the scene), are closed, however long",
        low=0,
        high=0.2,
    )
    openmvs_bin: str = setting("", "folder of the OpenMVS programs; empty: looked up on PATH")

    def __post_init__(self) -> None:
        check_settings(self, "dense")
