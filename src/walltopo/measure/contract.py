"""Settings of the scale stage (light: no heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["ScaleSettings"]


@dataclass(frozen=True)
class ScaleSettings:
    """How the reconstruction gets metres, an up direction and a floor."""

    method: str = setting(
        "auto",
        "auto: the reference's frame, else scale.distance, else the measure, else unscaled; "
        "the other words insist on one way and fail without it",
        choices=("auto", "measure", "distance", "none"),
    )
    plates: str = setting(
        "", "TOML file of the plates' geometry; empty = the plates of walltopo", content=(".",)
    )
    ignore_plates: str = setting(
        "", "plates to leave out, by their lowest marker id, comma-separated (such as 0,4)"
    )
    distance: str = setting(
        "", "a known distance as A-B=1.23 (metres): two photos, or two points of scale.points"
    )
    points: str = setting(
        "", "TOML file of named points given by their pixels in two or more photos", content=(".",)
    )
    way: str = setting(
        "auto",
        "estimation of the measure: markers (PnP per marker and photo, averaged), corners "
        "(triangulated, one similarity), auto = whichever fits the photos better",
        choices=("auto", "markers", "corners"),
    )
    max_disagreement: float = setting(
        0.01, "relative difference of scale at which a plate disagrees with the others", low=1e-4
    )
    max_residual: float = setting(
        5.0, "root mean square of a plate's corner residuals at which it disagrees", unit="mm"
    )

    def __post_init__(self) -> None:
        check_settings(self, "scale")
