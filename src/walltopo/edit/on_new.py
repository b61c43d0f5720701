"""A hold that the scan missed: its triangles, and its attributes by the code of `classify`."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.edit.board import Board, Scanned
from walltopo.edit.fit import fit_into_route
from walltopo.edit.grow import grow
from walltopo.edit.memory import remembered
from walltopo.edit.reading import Reading, read_hold
from walltopo.edit.sight import looks_at
from walltopo.holds.geometry import measure_shapes
from walltopo.scans.edits import Add

__all__ = ["add"]

_Grown = tuple[NDArray[np.int64], Reading]


def add(board: Board, edit: Add) -> None:
    """A hold grows at a place; it goes into the route that it fits."""
    scanned = board.scanned
    at = np.array(edit.hold.at if edit.hold.at is not None else (0.0, 0.0, 0.0))
    radius = edit.radius * scanned.unit
    around = scanned.triangles.within(at, 2 * radius)
    key = msgspec.json.encode(("grown", at.tolist(), radius)) + board.labels[around].tobytes()
    rows, reading = remembered(scanned, key, lambda: _grown(scanned, board.labels, at, radius))
    number = board.new_hold(edit.hold.id)
    board.holds[number] = msgspec.structs.replace(reading.hold, id=number)
    board.scores[number] = 1.0
    board.labels[rows] = number
    board.read[number] = rows
    board.pictures[number] = reading.best
    fit_into_route(board, number)


def _grown(
    scanned: Scanned, labels: NDArray[np.int32], at: NDArray[np.float64], radius: float
) -> _Grown:
    """The triangles, and what is known of the hold that they make."""
    looks = looks_at(scanned, at, radius, scanned.settings.photos)
    rows = grow(scanned, labels, at, radius, looks)
    own = np.where(labels > 0, -1, 0).astype(np.int32)
    own[rows] = 1
    (shape,) = measure_shapes(scanned.mesh, own, [1]).values()
    return rows, read_hold(scanned, own, shape, looks)
