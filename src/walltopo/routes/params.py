"""Settings of the `classify` and `routes` stages."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import SettingsError, check_settings, setting

__all__ = ["ClassifySettings", "RoutesSettings"]


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


@dataclass(frozen=True)
class RoutesSettings:
    """How holds of one colour are grouped into routes (section `routes`)."""

    min_hold_dist: float = setting(
        0.6, "Holds nearer than this along the wall are fully similar", unit="m", low=0, high=5
    )
    max_hold_dist: float = setting(
        1.6, "Holds farther than this along the wall are not linked", unit="m", low=0, high=10
    )
    flatten_ratio: float = setting(
        0.2, "The vertical part of a path counts by this factor (routes go up)", low=0, high=1
    )
    resolution: float = setting(
        0.5, "Resolution of Louvain: larger gives more, smaller routes", low=0, high=100
    )
    maker_weight: float = setting(
        0.75,
        "How much less similar two holds of one colour are whose makers are known and differ",
        low=0,
        high=1,
    )
    start_tags: bool = setting(
        True, "Cut a group where start tags mark several starts, and start routes at their tags"
    )
    link: str = setting(
        "colour",
        "colour: holds of one colour name are linked; paint: holds of like paint, for scans "
        "whose light is too uneven to name colours (see docs/routes.md)",
        choices=("colour", "paint"),
    )
    paint_resolution: float = setting(
        2.0, "With link = paint: resolution of Louvain over all colours", low=0, high=100
    )
    min_holds: int = setting(2, "Groups with fewer holds are left without a route", low=1, high=50)
    proxy_faces: int = setting(
        20_000, "Triangles of the simplified wall that paths run on", low=100, high=2_000_000
    )
    bridge_gap: float = setting(
        0.5,
        "Parts of the wall that end this near each other count as joined",
        unit="m",
        low=0,
        high=5,
    )
    typical_hold: float = setting(
        0.15,
        "Median hold size assumed where the scan has no scale; sets the unit of the distances",
        unit="m",
        low=0.02,
        high=1,
    )
    ambiguous_above: float = setting(
        0.3, "A second route with at least this probability makes a hold ambiguous", low=0, high=0.5
    )
    threads: int = setting(0, "Worker threads for the paths; 0: as many as cores", low=0, high=256)
    seed: int = setting(0, "Seed of Louvain", low=0)

    def __post_init__(self) -> None:
        check_settings(self, "routes")
        if self.max_hold_dist < self.min_hold_dist:
            raise SettingsError(
                "routes.max_hold_dist: expected at least routes.min_hold_dist "
                f"({self.min_hold_dist}), got {self.max_hold_dist}"
            )
