"""What photos and relief say of an instance that a setter shaped, by the code of `classify`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.colour import Coloured, assign_colours, paint_over_views
from walltopo.describe.classify.describe import with_tints, with_types
from walltopo.describe.classify.geometry import Shape
from walltopo.describe.classify.observations import HoldView, hold_views
from walltopo.describe.classify.observe import ERODE
from walltopo.describe.classify.palette import Entry
from walltopo.describe.classify.types import reliefs
from walltopo.editing.memory import remembered
from walltopo.editing.route_fit import fit_into_route
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.state import EditState
from walltopo.editing.view_crops import Look, looks_at
from walltopo.scans.attributes import UNKNOWN, Hold

# Share of its surface, old and new together, that must have changed for a hold to be read again.
# By hand, not fitted: the scan read it in all photos, this reads it in those that see it best.
CHANGED = 0.25
AROUND = 0.75  # of a hold's size: how much around its middle is looked at

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Reading:
    """What is known of an instance.

    Parameters
    ----------
    hold : with shape, colour, type, tint and photos; its id is 1.
    best : what the photo that shows it best shows; None where none does.
    """

    hold: Hold
    best: HoldView | None


def read_hold(
    scanned: ScanSnapshot, own: NDArray[np.int32], shape: Shape, looks: Sequence[Look]
) -> Reading:
    """Colour and type of the triangles labelled 1.

    Parameters
    ----------
    own : (F,) int32: 1 the instance, 0 the wall, -1 other instances.
    shape : of those triangles; looks : the place in photos.
    """
    seen = _views(own, looks, scanned.found.measured_with.cutout_px)
    colour = _colour(scanned, shape, seen)
    names = [view.name for view in scanned.views]
    hold = with_shape(
        Hold(
            1,
            "hold",
            colour=colour.name,
            colour_rgb=colour.rgb,
            colour_confidence=colour.confidence,
            photos=tuple(names[view.photo] for view in seen),
        ),
        shape,
    )
    relief = reliefs(scanned.mesh, own, {1: shape}, scanned.unit)
    (hold,) = with_tints(with_types([hold], relief), scanned.light, scanned.unit)
    return Reading(hold, seen[0] if seen else None)


def read_again(board: EditState, number: int, shape: Shape) -> None:
    """Give a hold whose triangles changed much the colour and type of what it is now.

    What a setter said of it stays, and so does its route; but what was cut off another hold goes
    where its own colour is, as long as no setter placed it.
    """
    before = board.holds[number]
    rows = np.flatnonzero(board.labels == number)
    if before.role != "hold" or not _is_changed(board, number, rows):
        return
    reading = _read_rows(board, rows, shape)
    said, new, hold = board.said.get(number, set()), reading.hold, before
    if "colour" not in said and new.colour != UNKNOWN:
        hold = replace(
            hold,
            colour=new.colour,
            colour_rgb=new.colour_rgb,
            colour_confidence=new.colour_confidence,
            wall_tint=new.wall_tint,
        )
    if "type" not in said:
        hold = replace(hold, type=new.type, type_confidence=new.type_confidence)
    board.holds[number] = replace(hold, photos=new.photos)
    board.pictures[number] = reading.best
    placed = number in board.decided or any(of == number for _, of in board.roles)
    if number in board.cut_off and not placed and hold.colour != before.colour:
        fit_into_route(board, number)


def _is_changed(board: EditState, number: int, rows: Ints) -> bool:
    """Whether a hold is another one than it was when its colour was read."""
    was = board.read.get(number)
    if was is None:
        was = np.flatnonzero(board.scanned.labels == number)
    areas = board.scanned.mesh.areas
    both = float(areas[np.intersect1d(rows, was, assume_unique=True)].sum())
    union = float(areas[rows].sum() + areas[was].sum()) - both
    return union - both > CHANGED * union


def _read_rows(board: EditState, rows: Ints, shape: Shape) -> Reading:
    def read() -> Reading:
        scanned = board.scanned
        own = np.where(board.labels > 0, -1, 0).astype(np.int32)
        own[rows] = 1
        reach = max(AROUND * shape.size, 0.1 * scanned.unit)
        looks = looks_at(scanned, shape.position, reach, scanned.settings.photos)
        return read_hold(scanned, own, shape, looks)

    return remembered(board.scanned, b"read" + rows.tobytes(), read)


def _views(own: NDArray[np.int32], looks: Sequence[Look], pixels: int) -> list[HoldView]:
    """What the photos show of the triangles labelled 1, the best first."""
    seen: list[HoldView] = []
    for look in looks:
        ids = np.where(look.face >= 0, own[np.maximum(look.face, 0)], 0)
        ids = np.maximum(ids, 0).astype(np.int32)
        seen += hold_views(look.photo, look.picture, ids, look.depth, ERODE, pixels)
    return sorted(seen, key=lambda view: (-view.quality, view.photo))


def _colour(scanned: ScanSnapshot, shape: Shape, seen: Sequence[HoldView]) -> Coloured:
    """Its colour, by the scan's light and palette; unknown where no photo shows it."""
    entries = [Entry(entry.name, entry.rgb) for entry in scanned.found.palette]
    if not seen or not entries:
        return Coloured(UNKNOWN, (128, 128, 128), 0.0)
    paints = paint_over_views({1: seen}, scanned.light, {1: shape.position})
    used = scanned.found.measured_with
    scale = {"spread": used.colour_spread, "lightness_weight": used.lightness_weight}
    return assign_colours(paints, entries, **scale)[1]


def with_shape(hold: Hold, shape: Shape) -> Hold:
    """The hold with the place and the measures of a shape."""
    x, y, z = shape.position.tolist()
    nx, ny, nz = shape.normal.tolist()
    return replace(
        hold,
        position=(x, y, z),
        normal=(nx, ny, nz),
        size=shape.size,
        area=shape.area,
        steepness_deg=shape.steepness_deg,
    )
