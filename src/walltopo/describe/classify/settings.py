"""Settings of the `classify` stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import about, check_settings
from walltopo.scans.scale import TYPICAL_HOLD


@dataclass(frozen=True)
class ClassifySettings:
    """How colour, type and geometry of each hold are found (section `classify`)."""

    # The middle of the best range on generated gyms (docs/lift.md).
    least_score: Annotated[
        float,
        about(
            "Instances with a lower score (few views confirm them) are listed as doubtful",
            low=0.0,
            high=1.0,
        ),
    ] = 0.15
    # Chosen on generated gyms that fitted nothing, for a precision of .98 (docs/propose.md).
    least_evidence: Annotated[
        float,
        about(
            "The same where relief and colour were asked besides (`propose`): instances that are "
            "less likely a hold are listed as doubtful",
            low=0.0,
            high=1.0,
        ),
    ] = 0.6
    # Between the thinnest holds and the flat marks of generated gyms (docs/colours.md).
    flat_below: Annotated[
        float,
        about(
            "Instances that stand out of the wall by less are tape, cards or marks, not holds; "
            "0: all are holds",
            unit="m",
            low=0.0,
            high=0.1,
        ),
    ] = 0.005
    cutouts: Annotated[int, about("Cutouts kept per hold", low=1, high=50, expert=True)] = 6
    cutout_px: Annotated[
        int, about("Longest side of a kept cutout", unit="px", low=32, high=1024, expert=True)
    ] = 160
    colour_spread: Annotated[
        float,
        about(
            "Colours nearer than this are one palette entry (see docs/colours.md)",
            low=0.02,
            high=1.0,
        ),
    ] = 0.13
    lightness_weight: Annotated[
        float,
        about(
            "Weight of lightness against hue and chroma when colours are grouped",
            low=0,
            high=2,
            expert=True,
        ),
    ] = 0.7
    palette: Annotated[
        str,
        about(
            "A palette.toml with names and reference colours; empty: found by clustering",
            content=(".",),
        ),
    ] = ""
    model: Annotated[
        str,
        about(
            "A classifier of cutouts (ONNX, class names in its metadata) that names types; empty: "
            "types come from the shape",
            content=(".",),
        ),
    ] = ""
    classes: Annotated[
        str,
        about(
            "A classes.toml: type, colour and role that the model's classes mean",
            content=(".",),
        ),
    ] = ""
    cutout_weight: Annotated[
        Literal["sharp", "area", "box"],
        about(
            "What a cutout weighs when the model's confidences are summed: its sharp, unhidden "
            "pixels; its pixels; or width times height of its box, over all cutouts, as published",
            expert=True,
        ),
    ] = "sharp"
    review_below: Annotated[
        float, about("Holds with a lower confidence are listed for a look", low=0, high=1)
    ] = 0.25
    typical_hold: Annotated[
        float,
        about(
            "Median hold size assumed where the scan has no scale",
            unit="m",
            low=0.02,
            high=1,
            expert=True,
        ),
    ] = TYPICAL_HOLD
    downclimb: Annotated[
        str,
        about(
            "Colour of the downclimb holds; auto: one of few, scattered, large jugs; empty: none"
        ),
    ] = "auto"

    def __post_init__(self) -> None:
        check_settings(self, "classify")
