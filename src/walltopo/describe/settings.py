"""Settings of the stages classify and routes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import SettingsError, about, check_settings
from walltopo.scans.scale import TYPICAL_HOLD


@dataclass(frozen=True)
class ClassifySettings:
    """Settings of colour, type and geometry of each hold (section `classify`)."""

    # The middle of the best range on generated gyms (docs/lift.md).
    # fmt: off
    min_score: Annotated[float, about("Minimum score of a hold; instances below it are listed as low-confidence", low=0.0, high=1.0)] = 0.15
    # Chosen for a precision of .98 on generated gyms outside the fit (docs/propose.md).
    min_evidence: Annotated[float, about("Minimum hold probability after `propose`; instances below it are listed as low-confidence", low=0.0, high=1.0, expert=True)] = 0.6
    # Between the thinnest holds and the flat marks of generated gyms (docs/colours.md).
    flat_below: Annotated[float, about("Instances that stand out of the wall by less are marks, not holds; 0: all are holds", unit="m", low=0.0, high=0.1, expert=True)] = 0.005
    cutouts: Annotated[int, about("Number of cutouts to keep per hold", low=1, high=50, expert=True)] = 6
    cutout_px: Annotated[int, about("Longer side of a cutout", unit="px", low=32, high=1024, expert=True)] = 160
    colour_spread: Annotated[float, about("Colours closer than this are one palette entry (docs/colours.md)", low=0.02, high=1.0, expert=True)] = 0.09
    lightness_weight: Annotated[float, about("Weight of lightness against hue and chroma when colours are grouped", low=0, high=2, expert=True)] = 0.6
    palette: Annotated[str, about("palette.toml with names and reference colours; empty: found by clustering", content=(".",))] = ""
    model: Annotated[str, about("ONNX classifier of cutouts that names types; empty: types come from the shape", content=(".",))] = ""
    classes: Annotated[str, about("classes.toml: type, colour and role of the classifier's classes", content=(".",), expert=True)] = ""
    cutout_weight: Annotated[Literal["sharp", "area", "box"], about("Weight of a cutout in the classifier's vote: sharp unhidden pixels, all pixels, or box area (published)", expert=True)] = "sharp"
    review_below: Annotated[float, about("Holds with a lower confidence are marked for review", low=0, high=1, expert=True)] = 0.25
    typical_hold: Annotated[float, about("Median hold size assumed in scans without a scale", unit="m", low=0.02, high=1, expert=True)] = TYPICAL_HOLD
    downclimb: Annotated[str, about("Colour of the downclimb holds; auto: few, scattered, large jugs of one colour; empty: none")] = "auto"
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "classify")


@dataclass(frozen=True)
class RoutesSettings:
    """Settings of the grouping of holds into routes (section `routes`)."""

    # fmt: off
    min_hold_dist: Annotated[float, about("link colour: holds closer than this along the wall are fully similar", unit="m", low=0, high=5, expert=True)] = 0.6
    max_hold_dist: Annotated[float, about("link colour: holds farther apart than this along the wall are not linked", unit="m", low=0, high=10, expert=True)] = 1.6
    flatten_ratio: Annotated[float, about("link colour: factor on the vertical part of a path", low=0, high=1, expert=True)] = 0.2
    resolution: Annotated[float, about("link colour: Louvain resolution; larger gives more, smaller routes", low=0, high=100)] = 0.5
    link: Annotated[Literal["colour", "paint"], about("Similarity of holds: paint (colour and distance), or colour (distance among one colour name, published)", expert=True)] = "paint"
    min_holds: Annotated[int, about("Groups with fewer holds make no route", low=1, high=50, expert=True)] = 2
    bridge_gap: Annotated[float, about("Parts of the wall that end this close to each other count as connected", unit="m", low=0, high=5, expert=True)] = 0.5
    ambiguous_above: Annotated[float, about("A second route with at least this probability makes a hold ambiguous", low=0, high=0.5, expert=True)] = 0.3
    threads: Annotated[int, about("CPU threads; 0 uses all", low=0, high=256, expert=True)] = 0
    seed: Annotated[int, about("Random seed", low=0, expert=True)] = 0
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "routes")
        if self.max_hold_dist < self.min_hold_dist:
            raise SettingsError(
                f"routes.max_hold_dist: expected at least routes.min_hold_dist ({self.min_hold_dist}), got {self.max_hold_dist}"
            )
