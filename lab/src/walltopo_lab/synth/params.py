"""Settings of the gym generator and its difficulty presets (light: no heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

from walltopo.core import SettingsError, about, check_settings

MAX_STICKERS = 587  # codes of the stickers' dictionary


@dataclass(frozen=True)
class GymSettings:
    """Parameters of a gym: the walls, their light, and the routes.

    Lengths and counts apply to one wall; `plates` counts those of all walls.
    """

    walls: Annotated[
        int, about("walls: one, or 4 and more around a floor", unit="walls", low=1, high=80)
    ] = 1
    width: Annotated[
        float, about("length of a wall along the floor", unit="m", low=1.5, high=60)
    ] = 8.0
    height: Annotated[float, about("height of the wall", unit="m", low=1.5, high=25)] = 4.2
    columns: Annotated[
        int, about("lines of corners along the wall (panels + 1)", low=2, high=60)
    ] = 5
    overhang_min_deg: Annotated[
        float, about("least lean of a panel", unit="deg", low=-30, high=60)
    ] = -5.0
    overhang_max_deg: Annotated[
        float, about("largest lean of a panel", unit="deg", low=-30, high=60)
    ] = 32.0
    corner_deg: Annotated[
        float, about("largest turn between panels", unit="deg", low=0, high=80)
    ] = 28.0
    facets: Annotated[
        float, about("0 = plane panels, 1 = every panel creased into facets", low=0, high=1)
    ] = 0.7
    fins: Annotated[int, about("fins that stand out of the wall", low=0, high=6)] = 0
    finish: Annotated[Literal["painted", "plywood", "textured"], about("surface of the panels")] = (
        "painted"
    )
    volumes: Annotated[int, about("volumes screwed to the wall", low=0, high=80)] = 5
    round_volumes: Annotated[
        float, about("share of the volumes that are round, of fibreglass", low=0, high=1)
    ] = 0.0
    routes: Annotated[int, about("routes set on it", low=1, high=120)] = 9
    holds_low: Annotated[
        int, about("fewest holds of a route, footholds not counted", low=3, high=60)
    ] = 8
    holds_high: Annotated[
        int, about("most holds of a route, footholds not counted", low=3, high=60)
    ] = 12
    footholds: Annotated[float, about("footholds per hold of a route", low=0, high=2)] = 0.35
    downclimb: Annotated[int, about("grey jugs to climb down", low=0, high=40)] = 3
    colours: Annotated[
        Literal["vivid", "faded", "plain", "neutral"], about("palette of the holds")
    ] = "vivid"
    two_coloured: Annotated[
        float, about("share of the holds with a second colour", low=0, high=1)
    ] = 0.0
    hold_scale: Annotated[
        float, about("size of the holds against real ones", low=0.4, high=2.5)
    ] = 1.0
    spray: Annotated[
        bool, about("dense spray wall: every colour everywhere, no spacing by route")
    ] = False
    chalk: Annotated[float, about("chalk on holds and wall", low=0, high=1)] = 0.5
    wear: Annotated[float, about("scuffs, scratches, dents and polish", low=0, high=1)] = 0.4
    lamps: Annotated[int, about("lamps over the mats", low=1, high=24)] = 5
    light: Annotated[float, about("brightness of the hall", low=0.05, high=3)] = 1.0
    warmth: Annotated[float, about("0 = daylight lamps, 1 = sodium yellow", low=0, high=1)] = 0.3
    room: Annotated[
        float, about("from the wall's ends to the room's side walls", unit="m", low=0, high=20)
    ] = 2.5
    benches: Annotated[int, about("benches before the wall", low=0, high=6)] = 0
    plates: Annotated[int, about("measures on the floor", low=0, high=12)] = 1
    stickers: Annotated[int, about("stickers on the wall", low=0, high=100)] = 0
    cell: Annotated[float, about("size of the wall's triangles", unit="m", low=0.008, high=0.2)] = (
        0.025
    )
    detail: Annotated[float, about("resolution of the holds' surface", low=0.3, high=3)] = 0.7

    def __post_init__(self) -> None:
        check_settings(self, "synth")
        if 1 < self.walls < 4:
            raise SettingsError(f"synth.walls: expected 1, or 4 and more, got {self.walls}")
        if self.walls * self.stickers > MAX_STICKERS:
            raise SettingsError(
                f"synth: {self.walls} walls with {self.stickers} stickers, but there are "
                f"{MAX_STICKERS} codes"
            )
        if self.overhang_min_deg > self.overhang_max_deg:
            raise SettingsError(
                "synth.overhang_min_deg: expected at most overhang_max_deg = "
                f"{self.overhang_max_deg}, got {self.overhang_min_deg}"
            )
        if self.holds_low > self.holds_high:
            raise SettingsError(
                f"synth.holds_low: expected at most holds_high = {self.holds_high}, "
                f"got {self.holds_low}"
            )


@dataclass(frozen=True)
class PhotoSettings:
    """Parameters of the photos and of the camera's path."""

    photos: Annotated[int, about("number of photos", low=1, high=2000)] = 24
    width: Annotated[int, about("width of a photo", unit="px", low=64, high=8000)] = 1600
    height: Annotated[int, about("height of a photo", unit="px", low=64, high=8000)] = 1200
    focal_35mm: Annotated[
        float, about("focal length as on 35 mm film", unit="mm", low=10, high=120)
    ] = 26.6
    k1: Annotated[float, about("radial distortion, COLMAP's SIMPLE_RADIAL", low=-0.3, high=0.3)] = (
        0.03
    )
    distance_low: Annotated[
        float, about("closest photo to the wall", unit="m", low=0.8, high=30)
    ] = 2.4
    distance_high: Annotated[float, about("farthest photo", unit="m", low=0.8, high=40)] = 4.2
    roll_deg: Annotated[float, about("spread of the roll", unit="deg", low=0, high=45)] = 3.0
    measure_share: Annotated[
        float, about("share of the photos taken at a measure", low=0, high=0.8)
    ] = 0.2
    noise: Annotated[
        float, about("sensor noise against a phone's in good light", low=0, high=10)
    ] = 1.0
    blur_px: Annotated[float, about("spread of the hand's blur", unit="px", low=0, high=10)] = 0.6
    exposure_spread: Annotated[float, about("spread of the exposure, in stops", low=0, high=2)] = (
        0.12
    )
    quality: Annotated[int, about("JPEG quality", low=30, high=100)] = 90
    samples: Annotated[int, about("rays a pixel = samples x samples", low=1, high=4)] = 2

    def __post_init__(self) -> None:
        check_settings(self, "synth")
        if self.distance_low > self.distance_high:
            raise SettingsError(
                "synth.distance_low: expected at most distance_high = "
                f"{self.distance_high}, got {self.distance_low}"
            )


# Each preset is a pair of overrides: for the gym and for the photos.
PRESETS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "easy": (
        {"width": 5.0, "height": 3.6, "columns": 3, "overhang_max_deg": 15.0, "facets": 0.0}
        | {"volumes": 2, "routes": 5, "chalk": 0.2, "wear": 0.2, "downclimb": 1},
        {"noise": 0.6, "exposure_spread": 0.05, "blur_px": 0.3},
    ),
    "modern": ({"fins": 1}, {}),
    "oldschool-dark": (
        {"finish": "plywood", "columns": 5, "facets": 0.1, "overhang_max_deg": 40.0}
        | {"volumes": 3, "routes": 11, "colours": "faded", "chalk": 0.9, "wear": 0.95}
        | {"light": 0.4, "warmth": 0.85, "lamps": 3, "hold_scale": 0.85, "footholds": 0.6},
        {"noise": 2.5, "exposure_spread": 0.3, "blur_px": 1.0},
    ),
    "sprawall": (
        {"width": 4.2, "height": 3.8, "columns": 2, "overhang_min_deg": 25.0}
        | {"overhang_max_deg": 40.0, "facets": 0.0, "volumes": 2, "routes": 22, "spray": True}
        | {"wear": 0.9, "chalk": 0.8, "hold_scale": 0.9, "downclimb": 0, "footholds": 0.3},
        {"distance_low": 2.2, "distance_high": 3.8},
    ),
    "lead": (
        {"width": 6.0, "height": 11.0, "columns": 4, "overhang_max_deg": 18.0, "facets": 0.4}
        | {"corner_deg": 15.0, "volumes": 6, "routes": 7, "holds_low": 18, "holds_high": 26}
        | {"finish": "textured", "downclimb": 0, "cell": 0.035, "chalk": 0.35},
        {"distance_low": 5.0, "distance_high": 8.5},
    ),
}


def gym_preset(name: str) -> tuple[GymSettings, PhotoSettings]:
    """Return the settings of a preset.

    Raises
    ------
    SettingsError : unknown preset; the message lists the known ones.
    """
    if name not in PRESETS:
        raise SettingsError(f"synth preset {name!r}: expected one of {', '.join(PRESETS)}")
    gym, photo = PRESETS[name]
    return replace(GymSettings(), **gym), replace(PhotoSettings(), **photo)
