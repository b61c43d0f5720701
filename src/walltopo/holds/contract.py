"""Settings of the `classify` stage."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["ClassifySettings"]


@dataclass(frozen=True)
class ClassifySettings:
    """How colour, type and geometry of each hold are found (section `classify`)."""

    # The middle of the best range on generated gyms (benchmarks/least_score.py).
    least_score: float = setting(
        0.15,
        "Instances with a lower score (few views confirm them) are no holds but listed as doubtful",
        low=0.0,
        high=1.0,
    )
    # Between the thinnest holds and the flat marks of generated gyms (benchmarks/flatness.py).
    flat_below: float = setting(
        0.005,
        "Instances that stand out of the wall by less are tape, cards or marks, not holds; "
        "0: all are holds",
        unit="m",
        low=0.0,
        high=0.1,
    )
    long_side: int = setting(
        1600, "Photos are read at most this long", unit="px", low=200, high=8000
    )
    erode: int = setting(
        2, "Pixels taken off the rim of a hold before its colour is read", unit="px", low=0, high=20
    )
    max_views: int = setting(
        12, "Views whose pixels are kept for the colour of one hold", low=1, high=200
    )
    cutouts: int = setting(6, "Cutouts kept per hold", low=1, high=50)
    cutout_px: int = setting(160, "Longest side of a kept cutout", unit="px", low=32, high=1024)
    colour_spread: float = setting(
        0.13,
        "Colours nearer than this are one palette entry (see docs/colours.md)",
        low=0.02,
        high=1.0,
    )
    lightness_weight: float = setting(
        0.7, "Weight of lightness against hue and chroma when colours are grouped", low=0, high=2
    )
    palette: str = setting(
        "",
        "A palette.toml with names and reference colours; empty: found by clustering",
        content=(".",),
    )
    model: str = setting(
        "",
        "A classifier of cutouts (ONNX, class names in its metadata) that names types; empty: "
        "types come from the shape",
        content=(".",),
    )
    classes: str = setting(
        "",
        "A classes.toml: type, colour, maker and role that the model's classes mean",
        content=(".",),
    )
    cutout_weight: str = setting(
        "sharp",
        "What a cutout weighs when the model's confidences are summed: its area, or its sharp, "
        "unhidden area",
        choices=("sharp", "area"),
    )
    review_below: float = setting(
        0.25, "Holds with a lower confidence are listed for a look", low=0, high=1
    )
    typical_hold: float = setting(
        0.15,
        "Median hold size assumed where the scan has no scale",
        unit="m",
        low=0.02,
        high=1,
    )
    start_tags: bool = setting(True, "Look for start tags: small cards on the wall")
    tag_shortest: float = setting(
        0.03, "Least length of the shorter side of a start tag", unit="m", low=0.01, high=1
    )
    tag_longest: float = setting(
        0.13, "Largest length of the longer side of a start tag", unit="m", low=0.02, high=1
    )
    tag_confidence: float = setting(
        0.4, "Start tags of a lower confidence are left out", low=0, high=1
    )
    downclimb: str = setting(
        "auto",
        "Colour of the downclimb holds; auto: a colour of few, scattered, large jugs; empty: none",
    )

    def __post_init__(self) -> None:
        check_settings(self, "classify")
