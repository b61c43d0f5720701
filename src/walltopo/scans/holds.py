"""`holds.json`: the table of holds; `work/holds.json`: the table before any edit."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Literal

import msgspec
from msgspec.structs import replace

from walltopo.core import InputError
from walltopo.scans.document import Coordinate, Document, Label, Rgb, Share, Unit
from walltopo.scans.routes import Route

Point = tuple[Coordinate, Coordinate, Coordinate]

UNKNOWN = "unknown"  # a colour or type that could not be determined
FLAT = "lies flat on the wall"  # reason for which an instance is not taken for a hold
# `hold` is climbed as part of one route; `volume` belongs to every route, `downclimb` to none.
Role = Literal["hold", "volume", "downclimb"]


def _rounded(values: Point, digits: int = 5) -> Point:
    x, y, z = (round(float(value), digits) for value in values)
    return x, y, z


class Hold(msgspec.Struct, frozen=True, eq=True):
    """One hold or volume with its attributes.

    Lengths are world units: metres if `Holds.metric`. The file's keys (`size_m`, `area_m2`) are
    named for that case, as other programs read them.

    Parameters
    ----------
    id : the instance's id (>= 1).
    kind : "hold" or "volume", the detector's class ("class" in the file).
    type : jug, crimp, ..., volume or "unknown".
    colour : a name of the palette, or "unknown" if no photo shows the hold.
    colour_rgb : 0..255, the hold's own colour under the scan's mean light.
    position : world frame; area centroid of the instance's surface.
    normal : unit, out of the wall.
    size : longest extent of the hold along the wall.
    area : surface area of its triangles.
    steepness_deg : of the wall under it: 0 vertical, > 0 overhanging, < 0 slab.
    photos : names of the photos that show it, best first.
    score : the confidence that it is a hold, in [0, 1].
    route : id of its route, None without one and before the stage `edit`.
    review : a setter should check it.
    role : see `Role`.
    type_confidence, colour_confidence : in [0, 1].
    wall_tint : relative colour of the wall around it, RGB, mean 1.
    left_out : why the instance is not shown as a hold; empty for holds.
    second_colour, second_rgb : the colour of the smaller part of a two-coloured hold; empty: none.
    """

    id: Label
    kind: str = msgspec.field(name="class")
    type: str = UNKNOWN
    colour: str = UNKNOWN
    colour_rgb: Rgb = (128, 128, 128)
    position: Point = (0.0, 0.0, 0.0)
    normal: Point = (0.0, -1.0, 0.0)
    size: Coordinate = msgspec.field(name="size_m", default=0.0)
    area: Coordinate = msgspec.field(name="area_m2", default=0.0)
    steepness_deg: Coordinate = 0.0
    photos: tuple[str, ...] = ()
    score: Share = 0.0
    route: Label | None = None
    review: bool = False
    role: Role = "hold"
    type_confidence: Share = 0.0
    colour_confidence: Share = 0.0
    wall_tint: Point = (1.0, 1.0, 1.0)
    left_out: str = ""
    second_colour: str = ""
    second_rgb: Rgb = (128, 128, 128)

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.position, *self.normal))):
            raise InputError(f"hold {self.id}: position and normal must be finite")

    @property
    def colours(self) -> tuple[str, ...]:
        """Return the names of the hold's one or two colours, that of the larger part first."""
        return (self.colour, self.second_colour) if self.second_colour else (self.colour,)

    def rounded(self) -> Hold:
        """Return the hold with the digits that are written to files."""
        return replace(
            self,
            type_confidence=round(self.type_confidence, 3),
            colour_confidence=round(self.colour_confidence, 3),
            position=_rounded(self.position),
            normal=_rounded(self.normal),
            size=round(self.size, 4),
            area=round(self.area, 6),
            steepness_deg=round(self.steepness_deg, 2),
            wall_tint=_rounded(self.wall_tint, 4),
            score=round(self.score, 4),
        )


class PaletteColour(msgspec.Struct, frozen=True):
    """A colour of the gym: its name and sRGB."""

    name: str
    rgb: Rgb


class MeasuredWith(msgspec.Struct, frozen=True):
    """Settings of `classify` with which an edited hold must be measured."""

    colour_spread: float = 0.13
    lightness_weight: float = 0.7
    cutout_px: int = 160


class Holds(Document, frozen=True, kw_only=True):
    """`holds.json`, and `work/holds.json` before any edit.

    Parameters
    ----------
    metric : whether lengths are metres.
    unit : scan units per metre: 1 if the scan has a scale, else estimated by the size of its holds.
    holds : the holds and volumes, in the order of ids.
    left_out : low-confidence instances, the highest score first.
    palette : the gym's colours.
    measured_with : settings with which the holds were measured.
    """

    metric: bool
    unit: Unit = 1.0
    holds: tuple[Hold, ...]
    left_out: tuple[Hold, ...] = ()
    palette: tuple[PaletteColour, ...] = ()
    measured_with: MeasuredWith = MeasuredWith()


def with_routes(holds: Iterable[Hold], routes: Iterable[Route]) -> tuple[Hold, ...]:
    """Return the holds in the order of ids, each with its first route."""
    route_of: dict[int, int] = {}
    for route in routes:
        for hold in route.holds:
            route_of.setdefault(hold, route.id)
    ordered = sorted(holds, key=lambda hold: hold.id)
    return tuple(replace(hold, route=route_of.get(hold.id)) for hold in ordered)


# Names of steepness, the same in the terminal, the report and the page. The page's own rules are in
# `viewer/src/data/steepness.ts` and `viewer/src/languages/format.ts`; a test of the viewer compares
# both.
VERTICAL_DEG = 5  # maximum number of whole degrees of a vertical wall


def steepness_words(degrees: float) -> str:
    """Return `vertical`, `12° overhang` or `8° slab`; positive degrees lean to the climber."""
    whole = round(abs(degrees))
    if whole <= VERTICAL_DEG:
        return "vertical"
    return f"{whole}° {'overhang' if degrees > 0 else 'slab'}"


def _count_with_word(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def count_words(routes: int, holds: Collection[Hold]) -> str:
    """Return `4 routes, 31 holds, 2 volumes`; the last part is omitted without volumes."""
    volumes = sum(hold.kind == "volume" for hold in holds)
    parts = [_count_with_word(routes, "route"), _count_with_word(len(holds) - volumes, "hold")]
    if volumes:
        parts.append(_count_with_word(volumes, "volume"))
    return ", ".join(parts)
