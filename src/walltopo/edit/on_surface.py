"""Entries about triangles: painted, cut, joined."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from walltopo.edit.board import Board
from walltopo.edit.notes import MissingError
from walltopo.scans.edits import Cut, Join, Paint

__all__ = ["cut", "join", "paint"]


def paint(board: Board, edit: Paint) -> None:
    """The triangles of a ball go to a hold, or to the wall."""
    number = board.hold(edit.hold).id if edit.hold.id else 0
    board.relabel(board.scanned.triangles.within(edit.at, edit.radius_m), number)


def cut(board: Board, edit: Cut) -> None:
    """Two parts on both sides of a line, as seen along the hold's normal; the larger keeps the id.

    The new one is in the route of the old one; where it has another colour, see `read_again`, in
    the route that it fits.
    """
    hold, mesh = board.hold(edit.hold), board.scanned.mesh
    start, end = np.array(edit.points)
    across = np.cross(end - start, hold.normal)
    if np.linalg.norm(across) < 1e-9:
        raise MissingError("no_line")
    rows = np.flatnonzero(board.labels == hold.id)
    side = (mesh.centroids[rows] - start) @ across > 0
    if side.all() or not side.any():
        raise MissingError("beside", edit.hold.id)
    if mesh.areas[rows[side]].sum() > mesh.areas[rows[~side]].sum():
        side = ~side
    new = board.new_hold(edit.new)
    board.holds[new] = replace(hold, id=new, review=False)
    board.scores[new] = board.scores.get(hold.id, 0.0)
    board.cut_off.add(new)
    route = board.route_of.get(hold.id, 0)
    board.relabel(rows[side], new)
    board.place(new, route)


def join(board: Board, edit: Join) -> None:
    """Instances become one under the first one's id, with its attributes.

    What the first has not, a route or a role, it takes from the first of the others that has.
    """
    numbers = list(dict.fromkeys(board.hold(ref).id for ref in edit.holds))
    if len(numbers) < 2:
        raise MissingError("holds_one", *(ref.id for ref in edit.holds))
    first, *others = numbers
    routes = [board.route_of[number] for number in numbers if number in board.route_of]
    roles = {key: role for key, role in board.roles.items() if key[1] in numbers}
    rows = np.flatnonzero(np.isin(board.labels, others))
    for number in others:
        board.drop(number)
    board.relabel(rows, first)
    if routes and board.holds[first].role == "hold":
        board.place(first, routes[0])
    for (route, _), role in roles.items():
        if route == board.route_of.get(first):
            board.roles.setdefault((route, first), role)
