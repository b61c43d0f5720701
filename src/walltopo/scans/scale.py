"""`scale.json`: whether lengths are metres, which plates were seen, and the world frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import msgspec
import numpy as np

from walltopo.scans.attributes import Hold
from walltopo.scans.document import Coordinate, Document, Label

Point = tuple[Coordinate, Coordinate, Coordinate]


class Plate(msgspec.Struct, frozen=True):
    """One printed plate of the measure.

    Parameters
    ----------
    ids : its markers; label : for people.
    used : whether it has a part in the scale.
    way : how its size was estimated ("markers", "corners"; "" where it was not).
    scale : metres per unit of the model as reconstructed, by this plate alone.
    residual_mm : root mean square of its corners' residuals; error_px : in the photos.
    photos : names of the photos that show it.
    problem : why it is not used; "".
    corners : of the sheet, world frame; empty where they are not known.
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
    """What is known of a world frame.

    Parameters
    ----------
    metric : its unit is the metre.
    up_known : z is up as a measure on the floor tells, not as estimated from the cameras.
    floor_known : z = 0 is the floor.
    """

    metric: bool
    up_known: bool
    floor_known: bool


class Scale(Document, frozen=True, kw_only=True):
    """`scale.json`.

    Parameters
    ----------
    method : "measure", "distance", "reference" or "none".
    scale : world units per unit of the model as reconstructed.
    metric, up_known, floor_known : see `Frame`.
    plates, notes : what was seen, and what people should know.
    reference_frame : method "reference": what identifies the frame (see `world_frame`).
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
        """What is known of the world frame."""
        return Frame(self.metric, self.up_known, self.floor_known)


TYPICAL_HOLD = 0.15  # metres: the median hold of a gym


def unit_of(holds: Sequence[Hold], metric: bool, typical_hold: float) -> float:
    """How many scan units a metre is: 1 for scaled scans.

    Without a scale the size of holds is the ruler: the median hold of a gym is about
    `typical_hold` long, so the unit is the median size of the scan's holds over that.
    """
    return unit_of_sizes((h.size for h in holds if h.role == "hold"), metric, typical_hold)


def unit_of_sizes(sizes: Iterable[float], metric: bool, typical_hold: float) -> float:
    """The same from the sizes of the holds alone, in scan units."""
    known = [size for size in sizes if size > 0]
    if metric or not known:
        return 1.0
    return float(np.median(known)) / typical_hold


class Aligned(Document, frozen=True, kw_only=True):
    """How a scan was aligned to a reference.

    Parameters
    ----------
    reference : the reference's scan folder.
    align : "constrained" or "rigid".
    reference_moved : largest change of any number in the reference's poses and intrinsics.
    shared_points : points that tie the two together.
    frame : what is known of the reference's world frame.
    reference_frame : what identifies it (see `world_frame`).
    """

    reference: str
    align: str
    reference_moved: float
    shared_points: int
    frame: Frame
    reference_frame: str = ""
