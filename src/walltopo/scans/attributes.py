"""`attributes.json`: what is known of each hold; `work/attributes.json`: before any edit."""

from __future__ import annotations

import math
from typing import Literal

import msgspec
from msgspec.structs import replace

from walltopo.core import InputError
from walltopo.scans.document import Coordinate, Document, Label, Rgb, Share, Unit

Point = tuple[Coordinate, Coordinate, Coordinate]

UNKNOWN = "unknown"  # the colour or type of a hold that nothing tells
FLAT = "lies flat on the wall"  # why an instance is left out that can be no hold
# `hold` is climbed as part of one route; `volume` belongs to every route, `downclimb` to none.
Role = Literal["hold", "volume", "downclimb"]


def _rounded(values: Point, digits: int = 5) -> Point:
    x, y, z = (round(float(value), digits) for value in values)
    return x, y, z


class Hold(msgspec.Struct, frozen=True, eq=True):
    """One instance with its attributes.

    Lengths are world units: metres where `Scale.metric`. The file's keys (`size_m`, `area_m2`) are
    named for that case, as other programs read them.

    Parameters
    ----------
    id : the instance's id (>= 1).
    kind : "hold" or "volume", the detector's class ("class" in the file).
    type : jug, crimp, ..., volume or "unknown".
    type_confidence, colour_confidence : 0 to 1.
    colour : a name of the palette, "unknown" where no photo shows the hold.
    colour_rgb : 0..255, the hold's own colour under the scan's mean light.
    position : world frame; area centroid of the instance's surface.
    normal : unit, out of the wall.
    size : longest extent of the hold along the wall.
    area : surface area of its triangles.
    steepness_deg : of the wall under it: 0 vertical, > 0 overhanging, < 0 slab.
    photos : names of the photos that show it, best first.
    role : see `Role`.
    review : someone should have a look.
    wall_tint : relative colour of the wall around it, RGB, mean 1.
    """

    id: Label
    kind: str = msgspec.field(name="class")
    type: str = UNKNOWN
    type_confidence: Share = 0.0
    colour: str = UNKNOWN
    colour_rgb: Rgb = (128, 128, 128)
    colour_confidence: Share = 0.0
    position: Point = (0.0, 0.0, 0.0)
    normal: Point = (0.0, -1.0, 0.0)
    size: Coordinate = msgspec.field(name="size_m", default=0.0)
    area: Coordinate = msgspec.field(name="area_m2", default=0.0)
    steepness_deg: Coordinate = 0.0
    photos: tuple[str, ...] = ()
    role: Role = "hold"
    review: bool = False
    wall_tint: Point = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.position, *self.normal))):
            raise InputError(f"hold {self.id}: position and normal must be finite")

    def rounded(self) -> Hold:
        """As it is written: tenths of millimetres and less say nothing."""
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
        )


class PaletteColour(msgspec.Struct, frozen=True):
    """A colour of the gym: its name and sRGB."""

    name: str
    rgb: Rgb


class LeftOut(msgspec.Struct, frozen=True):
    """An instance that is shown as no hold.

    Parameters
    ----------
    id, kind, position, size, photos : see `Hold`.
    score : of the instance; reason : why it is left out.
    """

    id: Label
    kind: str = msgspec.field(name="class")
    position: Point
    size: Coordinate = msgspec.field(name="size_m")
    photos: tuple[str, ...]
    score: Share
    reason: str


class Doubtful(msgspec.Struct, frozen=True):
    """An instance that is shown as no hold, with all that is known of it.

    Parameters
    ----------
    hold : what it would be; score : of the instance; reason : why it is left out.
    """

    hold: Hold
    score: Share
    reason: str

    def row(self) -> LeftOut:
        """Its row in `attributes.json`."""
        hold = self.hold.rounded()
        return LeftOut(
            hold.id,
            hold.kind,
            hold.position,
            hold.size,
            hold.photos,
            round(self.score, 4),
            self.reason,
        )


class MeasuredWith(msgspec.Struct, frozen=True):
    """Settings of `classify` that an edited hold must be measured with, too."""

    colour_spread: float = 0.13
    lightness_weight: float = 0.7
    cutout_px: int = 160


class RawAttributes(Document, frozen=True, kw_only=True):
    """`work/attributes.json`: what `classify` found, before any edit.

    Parameters
    ----------
    palette, instances : see `Attributes`.
    left_out : instances that are too doubtful to be holds, the surest first.
    unit : scan units in a metre: 1 where the scan has a scale, else by the size of its holds.
    measured_with : settings that the holds were measured with.
    """

    palette: tuple[PaletteColour, ...] = ()
    instances: tuple[Hold, ...]
    left_out: tuple[Doubtful, ...] = ()
    unit: Unit = 1.0
    measured_with: MeasuredWith = MeasuredWith()


class Attributes(Document, frozen=True, kw_only=True):
    """`attributes.json`.

    Parameters
    ----------
    palette : the gym's colours.
    instances : the holds and volumes, in the order of ids.
    left_out : instances that are too doubtful to be holds, the surest first.
    unit : scan units in a metre: 1 where the scan has a scale, else by the size of its holds.
    """

    palette: tuple[PaletteColour, ...] = ()
    instances: tuple[Hold, ...]
    left_out: tuple[LeftOut, ...] = ()
    unit: Unit = 1.0
