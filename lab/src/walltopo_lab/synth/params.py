"""Settings of the gym generator and its difficulty presets (light: no heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from walltopo.core import SettingsError, check_settings, setting

__all__ = ["PRESETS", "GymSettings", "PhotoSettings", "gym_preset"]


@dataclass(frozen=True)
class GymSettings:
    """What is built: the wall, its light and what is set on it."""

    width: float = setting(8.0, "length of the wall along the floor", unit="m", low=1.5, high=60)
    height: float = setting(4.2, "height of the wall", unit="m", low=1.5, high=25)
    columns: int = setting(5, "lines of corners along the wall (panels + 1)", low=2, high=60)
    overhang_min_deg: float = setting(-5.0, "least lean of a panel", unit="deg", low=-30, high=60)
    overhang_max_deg: float = setting(32.0, "largest lean of a panel", unit="deg", low=-30, high=60)
    corner_deg: float = setting(28.0, "largest turn between panels", unit="deg", low=0, high=80)
    facets: float = setting(
        0.7, "0 = plane panels, 1 = every panel creased into facets", low=0, high=1
    )
    fins: int = setting(0, "fins that stand out of the wall", low=0, high=6)
    finish: str = setting(
        "painted", "surface of the panels", choices=("painted", "plywood", "textured")
    )
    volumes: int = setting(5, "volumes screwed to the wall", low=0, high=80)
    round_volumes: float = setting(
        0.0, "share of the volumes that are round, of fibreglass", low=0, high=1
    )
    routes: int = setting(9, "routes set on it", low=1, high=120)
    holds_low: int = setting(8, "fewest holds of a route, footholds not counted", low=3, high=60)
    holds_high: int = setting(12, "most holds of a route, footholds not counted", low=3, high=60)
    footholds: float = setting(0.35, "footholds per hold of a route", low=0, high=2)
    downclimb: int = setting(3, "grey jugs to climb down", low=0, high=40)
    colours: str = setting("vivid", "palette of the holds", choices=("vivid", "faded"))
    hold_scale: float = setting(1.0, "size of the holds against real ones", low=0.4, high=2.5)
    spray: bool = setting(False, "dense spray wall: every colour everywhere, no spacing by route")
    chalk: float = setting(0.5, "chalk on holds and wall", low=0, high=1)
    wear: float = setting(0.4, "scuffs, scratches, dents and polish", low=0, high=1)
    lamps: int = setting(5, "lamps over the mats", low=1, high=24)
    light: float = setting(1.0, "brightness of the hall", low=0.05, high=3)
    warmth: float = setting(0.3, "0 = daylight lamps, 1 = sodium yellow", low=0, high=1)
    plates: int = setting(1, "measures on the floor", low=0, high=12)
    cell: float = setting(0.025, "size of the wall's triangles", unit="m", low=0.008, high=0.2)
    detail: float = setting(0.7, "resolution of the holds' surface", low=0.3, high=3)

    def __post_init__(self) -> None:
        check_settings(self, "synth")
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
    """How it is photographed."""

    photos: int = setting(24, "number of photos", low=1, high=2000)
    width: int = setting(1600, "width of a photo", unit="px", low=64, high=8000)
    height: int = setting(1200, "height of a photo", unit="px", low=64, high=8000)
    focal_35mm: float = setting(26.6, "focal length as on 35 mm film", unit="mm", low=10, high=120)
    k1: float = setting(0.03, "radial distortion, COLMAP's SIMPLE_RADIAL", low=-0.3, high=0.3)
    distance_low: float = setting(2.4, "closest photo to the wall", unit="m", low=0.8, high=30)
    distance_high: float = setting(4.2, "farthest photo", unit="m", low=0.8, high=40)
    roll_deg: float = setting(3.0, "spread of the roll", unit="deg", low=0, high=45)
    measure_share: float = setting(0.2, "share of the photos taken at a measure", low=0, high=0.8)
    noise: float = setting(1.0, "sensor noise against a phone's in good light", low=0, high=10)
    blur_px: float = setting(0.6, "spread of the hand's blur", unit="px", low=0, high=10)
    exposure_spread: float = setting(0.12, "spread of the exposure, in stops", low=0, high=2)
    quality: int = setting(90, "JPEG quality", low=30, high=100)
    samples: int = setting(2, "rays a pixel = samples x samples", low=1, high=4)

    def __post_init__(self) -> None:
        check_settings(self, "synth")
        if self.distance_low > self.distance_high:
            raise SettingsError(
                "synth.distance_low: expected at most distance_high = "
                f"{self.distance_high}, got {self.distance_low}"
            )


# Each preset is a pair of changes: of the gym and of the photos.
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
    """The settings of a preset.

    Raises
    ------
    SettingsError : there is no such preset; lists those that are.
    """
    if name not in PRESETS:
        raise SettingsError(f"synth preset {name!r}: expected one of {', '.join(PRESETS)}")
    gym, photo = PRESETS[name]
    return replace(GymSettings(), **gym), replace(PhotoSettings(), **photo)
