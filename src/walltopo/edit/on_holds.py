"""Entries about single holds: attributes, taken out, brought back."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from walltopo.edit.board import Board
from walltopo.edit.fit import fit_into_route, route_colour
from walltopo.scans.attributes import Doubtful, Hold
from walltopo.scans.edits import Keep, Remove, SetHold

__all__ = ["keep", "remove", "set_hold"]

REMOVED = "taken out by hand"


def set_hold(board: Board, edit: SetHold) -> None:
    """Correct class, colour and type; what was corrected is sure, and needs no review any more."""
    before = board.hold(edit.hold)
    hold = _of_kind(before, edit.kind or before.kind)
    said = board.said.setdefault(hold.id, set())
    said.update(name for name in ("colour", "type") if getattr(edit, name) is not None)
    if edit.colour is not None:
        hold = _painted(board, hold, edit.colour)
    if edit.type is not None:
        hold = replace(hold, type=edit.type, type_confidence=1.0)
    board.holds[hold.id] = replace(hold, review=False)
    if hold.role == before.role and hold.colour == before.colour:
        return
    route = board.route_of.get(hold.id)
    settled = route is not None and (
        hold.id in board.decided or route_colour(board, route) == hold.colour
    )
    if not settled or hold.role != "hold":
        fit_into_route(board, hold.id)


def _of_kind(hold: Hold, kind: str) -> Hold:
    if kind == hold.kind:
        return hold
    if kind == "volume":
        return replace(hold, kind=kind, role="volume", type="volume", type_confidence=1.0)
    return replace(hold, kind=kind, role="hold", type="unknown", type_confidence=0.0)


def _painted(board: Board, hold: Hold, colour: str) -> Hold:
    """The hold with a corrected colour: its name, and the paint of the others called so.

    Holds are linked by paint: with the one that it was seen with, it would stay where it is.
    """
    paints = [
        other.colour_rgb
        for other in board.holds.values()
        if other.colour == colour and other.id != hold.id
    ]
    red, green, blue = np.median(paints, axis=0).round() if paints else hold.colour_rgb
    rgb = int(red), int(green), int(blue)
    return replace(hold, colour=colour, colour_confidence=1.0, colour_rgb=rgb)


def remove(board: Board, edit: Remove) -> None:
    """It is no hold; `keep` brings it back."""
    hold = board.drop(board.hold(edit.hold).id)
    board.out[hold.id] = Doubtful(hold, board.scores.get(hold.id, 0.0), REMOVED)


def keep(board: Board, edit: Keep) -> None:
    """It is a hold after all, and goes into the route that it fits."""
    row = board.left_out(edit.hold)
    if row is None:
        hold = board.hold(edit.hold)  # the scan takes it for a hold by now
        board.holds[hold.id] = replace(hold, review=False)
        return
    del board.out[row.hold.id]
    board.holds[row.hold.id] = replace(row.hold, review=False)
    fit_into_route(board, row.hold.id)
