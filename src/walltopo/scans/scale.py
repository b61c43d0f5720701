"""`scale.json`: whether lengths are metres, how that is known, and the plates that were seen."""

from __future__ import annotations

import msgspec

from walltopo.scans.bounds import Coordinate, Label
from walltopo.scans.document import Document

__all__ = ["Frame", "Plate", "Scale"]

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
