"""Measure an instance that a setter shaped, in photos and relief, by the code of `classify`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.attributes import with_second_colour, with_tints, with_types
from walltopo.describe.classify.colour import HoldColour, assign_colours, paint_over_views
from walltopo.describe.classify.geometry import Shape
from walltopo.describe.classify.light import ERODE
from walltopo.describe.classify.observations import HoldView, hold_views
from walltopo.describe.classify.palette import Entry
from walltopo.describe.classify.two_colours import second_colours, split_paints
from walltopo.describe.classify.types import reliefs
from walltopo.editing.caches import cached
from walltopo.editing.route_fit import fit_into_route
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.state import EditState
from walltopo.editing.view_crops import ViewCrop, view_crops
from walltopo.scans.holds import UNKNOWN, Hold

# Minimum share of changed surface (old and new together) for a hold to be remeasured. Set by hand,
# not fitted: the scan measures it in all photos, the editor only in those that show it best.
CHANGED = 0.25
AROUND = 0.75  # of a hold's size: radius of the crops

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Remeasurement:
    """A new measurement of an instance in the photos.

    Parameters
    ----------
    hold : with shape, colour, type, tint and photos; its id is 1.
    best : the view in the photo that shows it best, or None.
    """

    hold: Hold
    best: HoldView | None


def measure_hold(
    snapshot: ScanSnapshot, own: NDArray[np.int32], shape: Shape, crops: Sequence[ViewCrop]
) -> Remeasurement:
    """Return colour and type of the triangles labelled 1.

    Parameters
    ----------
    own : (F,) int32: 1 the instance, 0 the wall, -1 other instances.
    shape : of those triangles; crops : the place in photos.
    """
    views = _best_views(own, crops, snapshot.found.measured_with.cutout_px)
    colour, second = _hold_colours(snapshot, views)
    names = [view.name for view in snapshot.views]
    hold = with_shape(
        Hold(
            1,
            "hold",
            colour=colour.name,
            colour_rgb=colour.rgb,
            colour_confidence=colour.confidence,
            photos=tuple(names[view.photo] for view in views),
        ),
        shape,
    )
    hold = with_second_colour(hold, second)
    relief = reliefs(snapshot.mesh, own, {1: shape}, snapshot.unit)
    (hold,) = with_tints(with_types([hold], relief), snapshot.light, snapshot.unit)
    return Remeasurement(hold, views[0] if views else None)


def remeasure(state: EditState, number: int, shape: Shape) -> None:
    """Give a hold whose triangles changed much the colour and type of its present triangles.

    Values from a setter stay, and so does the route. A part that was cut off another hold moves to
    the route of its own colour, unless a setter placed it.
    """
    before = state.holds[number]
    rows = np.flatnonzero(state.labels == number)
    if before.role != "hold" or not _is_changed(state, number, rows):
        return
    measured = _remeasure_rows(state, rows, shape)
    by_setter, new, hold = state.by_setter.get(number, set()), measured.hold, before
    if "colour" not in by_setter and new.colour != UNKNOWN:
        hold = replace(
            hold,
            colour=new.colour,
            colour_rgb=new.colour_rgb,
            colour_confidence=new.colour_confidence,
            wall_tint=new.wall_tint,
        )
    if "second_colour" not in by_setter and new.colour != UNKNOWN:
        # A setter's colour may be the measured second one.
        second = "" if new.second_colour == hold.colour else new.second_colour
        hold = replace(hold, second_colour=second, second_rgb=new.second_rgb)
    if "type" not in by_setter:
        hold = replace(hold, type=new.type, type_confidence=new.type_confidence)
    state.holds[number] = replace(hold, photos=new.photos)
    state.pictures[number] = measured.best
    placed = number in state.decided or any(hold_id == number for _, hold_id in state.roles)
    if number in state.cut_off and not placed and hold.colour != before.colour:
        fit_into_route(state, number)


def _is_changed(state: EditState, number: int, rows: Ints) -> bool:
    """Return whether a hold's triangles changed much since its colour was measured."""
    was = state.measured_rows.get(number)
    if was is None:
        was = np.flatnonzero(state.snapshot.labels == number)
    areas = state.snapshot.mesh.areas
    both = float(areas[np.intersect1d(rows, was, assume_unique=True)].sum())
    union = float(areas[rows].sum() + areas[was].sum()) - both
    return union - both > CHANGED * union


def _remeasure_rows(state: EditState, rows: Ints, shape: Shape) -> Remeasurement:
    def measure() -> Remeasurement:
        snapshot = state.snapshot
        own = np.where(state.labels > 0, -1, 0).astype(np.int32)
        own[rows] = 1
        reach = max(AROUND * shape.size, 0.1 * snapshot.unit)
        crops = view_crops(snapshot, shape.position, reach, snapshot.settings.photos)
        return measure_hold(snapshot, own, shape, crops)

    return cached(state.snapshot, b"read" + rows.tobytes(), measure)


def _best_views(own: NDArray[np.int32], crops: Sequence[ViewCrop], pixels: int) -> list[HoldView]:
    """Return the views of the triangles labelled 1, best first."""
    views: list[HoldView] = []
    for crop in crops:
        ids = np.where(crop.face >= 0, own[np.maximum(crop.face, 0)], 0)
        ids = np.maximum(ids, 0).astype(np.int32)
        views += hold_views(crop.photo, crop.picture, ids, crop.depth, ERODE, pixels)
    return sorted(views, key=lambda view: (-view.quality, view.photo))


def _hold_colours(
    snapshot: ScanSnapshot, views: Sequence[HoldView]
) -> tuple[HoldColour, HoldColour | None]:
    """Return the colour and a second one, by the scan's light and palette.

    The colour is unknown if no photo shows the hold.
    """
    entries = [Entry(entry.name, entry.rgb) for entry in snapshot.found.palette]
    if not views or not entries:
        return HoldColour(UNKNOWN, (128, 128, 128), 0.0), None
    used = snapshot.found.measured_with
    scale = {"spread": used.colour_spread, "lightness_weight": used.lightness_weight}
    by_hold, light = {1: views}, snapshot.light
    paints, second = split_paints(paint_over_views(by_hold, light), by_hold, light, ())
    colours = assign_colours(paints, entries, **scale)
    return colours[1], second_colours(second, colours, entries, **scale).get(1)


def with_shape(hold: Hold, shape: Shape) -> Hold:
    """Return the hold with the position and the measurements of a shape."""
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
