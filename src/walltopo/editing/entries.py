"""What each kind of edit does to holds, routes and triangles."""

from __future__ import annotations

import dataclasses

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.geometry import measure_shapes
from walltopo.editing.grow import grow
from walltopo.editing.memory import remembered
from walltopo.editing.notes import MissingError
from walltopo.editing.remeasure import Reading, read_hold
from walltopo.editing.route_fit import fit_into_route, route_colour
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.state import EditState, RouteFacts
from walltopo.editing.view_crops import looks_at
from walltopo.scans.attributes import Doubtful, Hold
from walltopo.scans.edits import (
    Add,
    Assign,
    Cut,
    Join,
    Keep,
    Leave,
    Merge,
    Paint,
    Ref,
    Remove,
    RoleName,
    SetHold,
    SetProblem,
    SetRole,
    SetRoute,
    Share,
    Split,
)

REMOVED = "taken out by hand"


def set_hold(board: EditState, edit: SetHold) -> None:
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


def _painted(board: EditState, hold: Hold, colour: str) -> Hold:
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


def remove(board: EditState, edit: Remove) -> None:
    """It is no hold; `keep` brings it back."""
    hold = board.drop(board.hold(edit.hold).id)
    board.out[hold.id] = Doubtful(hold, board.scores.get(hold.id, 0.0), REMOVED)


def keep(board: EditState, edit: Keep) -> None:
    """It is a hold after all, and goes into the route that it fits."""
    row = board.left_out(edit.hold)
    if row is None:
        hold = board.hold(edit.hold)  # the scan takes it for a hold by now
        board.holds[hold.id] = replace(hold, review=False)
        return
    del board.out[row.hold.id]
    board.holds[row.hold.id] = replace(row.hold, review=False)
    fit_into_route(board, row.hold.id)


_Grown = tuple[NDArray[np.int64], Reading]


def add(board: EditState, edit: Add) -> None:
    """A hold grows at a place; it goes into the route that it fits."""
    scanned = board.scanned
    at = np.array(edit.hold.at if edit.hold.at is not None else (0.0, 0.0, 0.0))
    radius = edit.radius * scanned.unit
    around = scanned.triangles.within(at, 2 * radius)
    key = msgspec.json.encode(("grown", at.tolist(), radius)) + board.labels[around].tobytes()
    rows, reading = remembered(scanned, key, lambda: _grown(scanned, board.labels, at, radius))
    number = board.new_hold(edit.hold.id)
    board.holds[number] = replace(reading.hold, id=number)
    board.scores[number] = 1.0
    board.labels[rows] = number
    board.read[number] = rows
    board.pictures[number] = reading.best
    fit_into_route(board, number)


def _grown(
    scanned: ScanSnapshot, labels: NDArray[np.int32], at: NDArray[np.float64], radius: float
) -> _Grown:
    """The triangles, and what is known of the hold that they make."""
    looks = looks_at(scanned, at, radius, scanned.settings.photos)
    rows = grow(scanned, labels, at, radius, looks)
    own = np.where(labels > 0, -1, 0).astype(np.int32)
    own[rows] = 1
    (shape,) = measure_shapes(scanned.mesh, own, [1]).values()
    return rows, read_hold(scanned, own, shape, looks)


def merge(board: EditState, edit: Merge) -> None:
    """Routes become one, under the first one's id, with what was said of that one."""
    routes = list(dict.fromkeys(board.route(ref) for ref in edit.routes))
    if len(routes) < 2:
        raise MissingError("routes_one", *(ref.id for ref in edit.routes))
    first, *others = routes
    for hold, route in board.route_of.items():
        if route in routes:
            board.route_of[hold] = first
            board.decided.add(hold)
    for route in others:
        board.facts.pop(route, None)
        for hold in board.shared.pop(route, []):
            board.share(hold, first)
    for (route, hold), role in list(board.roles.items()):
        if route in others:
            del board.roles[route, hold]
            board.roles.setdefault((first, hold), role)


def split(board: EditState, edit: Split) -> None:
    """Holds leave their route, with their roles, and make one of their own."""
    holds = list(dict.fromkeys(_climbed(board, ref) for ref in edit.holds))
    left = {board.route_of[hold] for hold in holds if hold in board.route_of}
    board.decided.update(hold for hold, route in board.route_of.items() if route in left)
    new = board.new_route(edit.new)
    for hold in holds:
        role = board.roles.get((board.route_of.get(hold, 0), hold))
        board.place(hold, new)
        if role is not None:
            board.roles[new, hold] = role
        board.decided.add(hold)
    _forget_empty(board, left)


def assign(board: EditState, edit: Assign) -> None:
    """A hold belongs to a route, or to none."""
    hold = _climbed(board, edit.hold)
    left = {board.route_of.get(hold, 0)}
    if edit.route.id == 0:
        left = {*board.routes_of(hold)}
        for route in left:
            board.leave(hold, route)
    else:
        board.place(hold, board.route(edit.route))
        # Whoever puts a downclimb hold into a route says that it is none.
        board.holds[hold] = replace(board.holds[hold], role="hold")
    board.decided.add(hold)
    _forget_empty(board, left)


def set_problem(board: EditState, edit: SetProblem) -> None:
    """A new route on holds that stay where they are."""
    hands = list(dict.fromkeys(_climbed(board, ref) for ref in edit.hands))
    said: tuple[tuple[RoleName, tuple[Ref, ...]], ...] = (
        ("foot", edit.feet),
        ("start", edit.start),
        ("top", edit.top),
    )
    roles: dict[int, RoleName] = dict.fromkeys(hands, "hand")
    for role, refs in said:
        roles |= dict.fromkeys((_climbed(board, ref) for ref in refs), role)
    number = board.new_route(edit.new)
    for hold, role in roles.items():
        board.share(hold, number)
        board.roles[number, hold] = role
    board.facts[number] = RouteFacts(proposed=edit.proposed)


def share(board: EditState, edit: Share) -> None:
    """A hold is of a route beside its own."""
    board.share(_climbed(board, edit.hold), board.route(edit.route))


def leave(board: EditState, edit: Leave) -> None:
    """A hold is not of a route any more."""
    hold, route = board.hold(edit.hold).id, board.route(edit.route)
    if route not in board.routes_of(hold):
        raise MissingError("other_route", edit.hold.id, edit.route.id)
    board.leave(hold, route)
    board.decided.add(hold)
    _forget_empty(board, {route})


def set_route(board: EditState, edit: SetRoute) -> None:
    """What is said of a route; empty text takes it back."""
    route = board.route(edit.route)
    said = {
        name: getattr(edit, name)
        for name in RouteFacts.__dataclass_fields__
        if getattr(edit, name) is not None
    }
    board.facts[route] = dataclasses.replace(board.facts.get(route, RouteFacts()), **said)


def set_role(board: EditState, edit: SetRole) -> None:
    """What a hold is in its route."""
    hold, route = board.hold(edit.hold), board.route(edit.route)
    if hold.role != "volume" and route not in board.routes_of(hold.id):
        raise MissingError("other_route", edit.hold.id, edit.route.id)
    board.roles[route, hold.id] = edit.role


def _climbed(board: EditState, ref: Ref) -> int:
    """The id of a hold that may be of one route."""
    hold = board.hold(ref)
    if hold.role == "volume":
        raise MissingError("volume", ref.id)
    return hold.id


def _forget_empty(board: EditState, routes: set[int]) -> None:
    """What was said of routes that have no hold any more."""
    for route in routes - board.routes:
        board.facts.pop(route, None)
        for key in [key for key in board.roles if key[0] == route]:
            del board.roles[key]


def paint(board: EditState, edit: Paint) -> None:
    """The triangles of a ball go to a hold, or to the wall."""
    number = board.hold(edit.hold).id if edit.hold.id else 0
    board.relabel(board.scanned.triangles.within(edit.at, edit.radius_m), number)


def cut(board: EditState, edit: Cut) -> None:
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


def join(board: EditState, edit: Join) -> None:
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
