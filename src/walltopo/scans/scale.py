"""`scale.json`: the unit of lengths, the scale plates, and the world frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import msgspec
import numpy as np

from walltopo.scans.document import Coordinate, Document, Label
from walltopo.scans.holds import Hold

Point = tuple[Coordinate, Coordinate, Coordinate]


class Plate(msgspec.Struct, frozen=True):
    """One scale plate.

    Parameters
    ----------
    ids : ids of its markers; label : for people.
    used : whether it contributes to the scale.
    way : how its size was estimated ("markers", "corners"; "" if it was not).
    scale : metres per unit of the model as reconstructed, by this plate alone.
    residual_mm : root mean square of its corners' residuals; error_px : in the photos.
    photos : names of the photos that show it.
    problem : why it is not used; "" if it is.
    corners : of the sheet, world frame; empty if unknown.
    """

    ids: tuple[Label, ...]
    label: str
    used: bool
    way: str
    scale: Coordinate
    residual_mm: float
    error_px: float
    photos: tuple[str, ...]
    problem: str
    corners: tuple[Point, ...] = ()


class Frame(msgspec.Struct, frozen=True):
    """Properties of a world frame.

    Parameters
    ----------
    metric : whether the unit is the metre.
    up_known : whether a scale plate on the floor gives the z axis, and not the cameras.
    floor_known : whether z = 0 is the floor.
    """

    metric: bool
    up_known: bool
    floor_known: bool


class Scale(Document, frozen=True, kw_only=True):
    """`scale.json`.

    Parameters
    ----------
    method : "measure", "stickers", "distance", "poses", "reference" or "none".
    scale : world units per unit of the model as reconstructed.
    metric, up_known, floor_known : see `Frame`.
    plates, notes : the plates found, and notes for people.
    reference_frame : identity of the frame for method "reference" (see `world_frame`).
    """

    method: str
    scale: Coordinate
    metric: bool
    up_known: bool
    floor_known: bool
    plates: tuple[Plate, ...] = ()
    notes: tuple[str, ...] = ()
    reference_frame: str = ""

    @property
    def frame(self) -> Frame:
        """Return the properties of the world frame."""
        return Frame(self.metric, self.up_known, self.floor_known)


TYPICAL_HOLD = 0.15  # metres: the median size of a gym's holds


def unit_of(holds: Sequence[Hold], metric: bool, typical_hold: float) -> float:
    """Return the scan units per metre: 1 for scaled scans.

    Without a scale, the size of the holds gives the unit: the median hold of a gym is about
    `typical_hold` long.
    """
    return unit_of_sizes((h.size for h in holds if h.role == "hold"), metric, typical_hold)


def unit_of_sizes(sizes: Iterable[float], metric: bool, typical_hold: float) -> float:
    """Return the scan units per metre from sizes of holds, in scan units."""
    known = [size for size in sizes if size > 0]
    if metric or not known:
        return 1.0
    return float(np.median(known)) / typical_hold


class Aligned(Document, frozen=True, kw_only=True):
    """The alignment of a scan to a reference.

    Parameters
    ----------
    reference : scan folder of the reference.
    align : "constrained" or "rigid".
    reference_moved : largest change of any number in the reference's poses and intrinsics.
    shared_points : number of points that connect both.
    frame : properties of the reference's world frame.
    reference_frame : its identity (see `world_frame`).
    """

    reference: str
    align: str
    reference_moved: float
    shared_points: int
    frame: Frame
    reference_frame: str = ""
