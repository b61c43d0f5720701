"""A hold that the scan missed: its triangles, and its attributes by the code of `classify`."""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.edit.board import Board, Scanned
from walltopo.edit.fit import fit_into_route
from walltopo.edit.grow import grow
from walltopo.edit.shapes import with_shape
from walltopo.edit.sight import Look, looks_at
from walltopo.holds.colour import Coloured, assign_colours, paint_over_views
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.describe import with_tints, with_types
from walltopo.holds.geometry import Shape, measure_shapes
from walltopo.holds.observations import HoldView, hold_views
from walltopo.holds.observe import ERODE
from walltopo.holds.palette import Entry
from walltopo.holds.relief import reliefs
from walltopo.scans.attributes import UNKNOWN, Hold
from walltopo.scans.edits import Add

__all__ = ["add"]

_Grown = tuple[NDArray[np.int64], Hold]
# What grew at a place of a mesh whose labels around it were the same: a log is replayed often.
_KNOWN: WeakKeyDictionary[Scanned, dict[bytes, _Grown]] = WeakKeyDictionary()
MOST_KNOWN = 500
# As `classify` has it, where the scan does not say: the setting is another stage's.
CLASSIFY = ClassifySettings()


def add(board: Board, edit: Add) -> None:
    """A hold grows at a place; it goes into the route that it fits."""
    scanned = board.scanned
    at = np.array(edit.hold.at if edit.hold.at is not None else (0.0, 0.0, 0.0))
    radius = edit.radius * scanned.unit
    around = scanned.triangles.within(at, 2 * radius)
    key = msgspec.json.encode((at.tolist(), radius)) + board.labels[around].tobytes()
    known = _KNOWN.setdefault(scanned, {})
    if key not in known:
        if len(known) >= MOST_KNOWN:
            known.clear()
        known[key] = _grown(scanned, board.labels, at, radius)
    rows, hold = known[key]
    number = board.new_hold(edit.hold.id)
    board.holds[number] = msgspec.structs.replace(hold, id=number)
    board.scores[number] = 1.0
    board.labels[rows] = number
    fit_into_route(board, number)


def _grown(
    scanned: Scanned, labels: NDArray[np.int32], at: NDArray[np.float64], radius: float
) -> _Grown:
    """The triangles, and what is known of the hold that they make (its id is 0)."""
    looks = looks_at(scanned, at, radius, scanned.settings.photos)
    rows = grow(scanned, labels, at, radius, looks)
    own = np.where(labels > 0, -1, 0).astype(np.int32)
    own[rows] = 1
    (shape,) = measure_shapes(scanned.mesh, own, [1]).values()
    seen = _views(own, looks)
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
    return rows, hold


def _views(own: NDArray[np.int32], looks: Sequence[Look]) -> list[HoldView]:
    """What the photos show of the triangles labelled 1, the best first."""
    seen: list[HoldView] = []
    for look in looks:
        ids = np.where(look.face >= 0, own[np.maximum(look.face, 0)], 0)
        ids = np.maximum(ids, 0).astype(np.int32)
        seen += hold_views(look.photo, look.picture, ids, look.depth, ERODE, CLASSIFY.cutout_px)
    return sorted(seen, key=lambda view: (-view.quality, view.photo))


def _colour(scanned: Scanned, shape: Shape, seen: Sequence[HoldView]) -> Coloured:
    """Its colour, by the scan's light and palette; unknown where no photo shows it."""
    entries = [Entry(entry.name, entry.rgb) for entry in scanned.found.palette]
    if not seen or not entries:
        return Coloured(UNKNOWN, (128, 128, 128), 0.0)
    paints = paint_over_views({1: seen}, scanned.light, {1: shape.position})
    scale = {
        "spread": CLASSIFY.colour_spread,
        "lightness_weight": CLASSIFY.lightness_weight,
    }
    return assign_colours(paints, entries, **scale)[1]
