"""Settings of the scale stage (light: no heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class ScaleSettings:
    """How the reconstruction gets metres, an up direction and a floor."""

    method: Annotated[
        Literal["auto", "measure", "distance", "none"],
        about(
            "auto: the reference's frame, else scale.distance, else the measure, else unscaled; "
            "the other words insist on one way and fail without it"
        ),
    ] = "auto"
    plates: Annotated[
        str,
        about("TOML file of the plates' geometry; empty = the plates of walltopo", content=(".",)),
    ] = ""
    ignore_plates: Annotated[
        str, about("plates to leave out, by their lowest marker id, comma-separated (such as 0,4)")
    ] = ""
    distance: Annotated[
        str,
        about("a known distance as A-B=1.23 (metres): two photos, or two points of scale.points"),
    ] = ""
    points: Annotated[
        str,
        about(
            "TOML file of named points given by their pixels in two or more photos", content=(".",)
        ),
    ] = ""
    way: Annotated[
        Literal["auto", "markers", "corners", "published"],
        about(
            "estimation of the measure: markers (PnP per marker and photo, averaged), corners "
            "(triangulated, one similarity), both polished by the reprojection of all corners; "
            "auto = whichever fits the photos better; published = markers, not polished",
            expert=True,
        ),
    ] = "auto"

    def __post_init__(self) -> None:
        check_settings(self, "scale")
