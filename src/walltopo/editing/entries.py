"""The effect of each kind of edit on holds, routes and triangles."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.geometry import measure_shapes
from walltopo.editing.caches import cached
from walltopo.editing.grow import grow
from walltopo.editing.hiding import without_place
from walltopo.editing.messages import MissingError
from walltopo.editing.remeasure import Remeasurement, measure_hold
from walltopo.editing.route_fit import fit_into_route, route_colour
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.solid import solid_at
from walltopo.editing.state import EditState, RouteFacts
from walltopo.editing.view_crops import ViewCrop, view_crops
from walltopo.scans.document import Rgb
from walltopo.scans.edits import (
    Add,
    Assign,
    Cut,
    Hide,
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
    Unhide,
)
from walltopo.scans.hidden import HiddenPlace
from walltopo.scans.holds import Hold
from walltopo.segment.propose.solids import LONGEST

REMOVED = "taken out by hand"


def set_hold(state: EditState, edit: SetHold) -> None:
    """Correct class, colours and type; corrected values are certain and need no review."""
    before = state.hold(edit.hold)
    hold = _of_kind(before, edit.kind or before.kind)
    by_setter = state.by_setter.setdefault(hold.id, set())
    given = ("colour", "second_colour", "type")
    by_setter.update(name for name in given if getattr(edit, name) is not None)
    if edit.colour is not None:
        hold = _recoloured_hold(state, hold, edit.colour)
    if edit.second_colour is not None:
        rgb = _paint_named(state, hold, edit.second_colour, hold.second_rgb)
        hold = replace(hold, second_colour=edit.second_colour, second_rgb=rgb)
    if hold.second_colour == hold.colour:
        hold = replace(hold, second_colour="")
    if edit.type is not None:
        hold = replace(hold, type=edit.type, type_confidence=1.0)
    state.holds[hold.id] = replace(hold, review=False)
    if hold.role == before.role and hold.colours == before.colours:
        return
    route = state.route_of.get(hold.id)
    settled = route is not None and (
        hold.id in state.decided or route_colour(state, route) in hold.colours
    )
    if not settled or hold.role != "hold":
        fit_into_route(state, hold.id)


def _of_kind(hold: Hold, kind: str) -> Hold:
    if kind == hold.kind:
        return hold
    if kind == "volume":
        return replace(hold, kind=kind, role="volume", type="volume", type_confidence=1.0)
    return replace(hold, kind=kind, role="hold", type="unknown", type_confidence=0.0)


def _recoloured_hold(state: EditState, hold: Hold, colour: str) -> Hold:
    """Return the hold with a corrected colour: its name, and the paint of holds with that name.

    Holds are linked by paint. With its measured paint, the hold would stay in its route.
    """
    rgb = _paint_named(state, hold, colour, hold.colour_rgb)
    return replace(hold, colour=colour, colour_confidence=1.0, colour_rgb=rgb)


def _paint_named(state: EditState, hold: Hold, colour: str, without: Rgb) -> Rgb:
    """Return the paint of the other holds with a colour; `without` if no other hold has it."""
    paints = [
        other.colour_rgb
        for other in state.holds.values()
        if other.colour == colour and other.id != hold.id
    ]
    red, green, blue = np.median(paints, axis=0).round() if paints else without
    return int(red), int(green), int(blue)


def remove(state: EditState, edit: Remove) -> None:
    """Mark an instance as no hold; `keep` restores it."""
    hold = state.drop(state.hold(edit.hold).id)
    state.non_holds[hold.id] = replace(hold, left_out=REMOVED)


def keep(state: EditState, edit: Keep) -> None:
    """Restore an instance as a hold, in the route that it fits."""
    found = state.non_hold(edit.hold)
    if found is None:
        hold = state.hold(edit.hold)  # a newer scan already has it as a hold
        state.holds[hold.id] = replace(hold, review=False)
        return
    del state.non_holds[found.id]
    state.holds[found.id] = replace(found, review=False, left_out="")
    fit_into_route(state, found.id)


_Measured = tuple[NDArray[np.int64], Remeasurement]


def add(state: EditState, edit: Add) -> None:
    """Add a hold that grows at a place, in the route that it fits, or the volume at a place."""
    snapshot = state.snapshot
    at = np.array(edit.hold.at if edit.hold.at is not None else (0.0, 0.0, 0.0))
    is_volume = edit.kind == "volume"
    radius = (LONGEST if is_volume else edit.radius) * snapshot.unit
    around = snapshot.triangles.within(at, 2 * radius)
    key = msgspec.json.encode((edit.kind, at.tolist(), radius)) + state.labels[around].tobytes()
    made = _find_solid if is_volume else _grow_hold
    rows, measured = cached(snapshot, key, lambda: made(snapshot, state.labels, at, radius))
    number = state.new_hold(edit.hold.id)
    state.holds[number] = _of_kind(replace(measured.hold, id=number, score=1.0), edit.kind)
    state.labels[rows] = number
    state.measured_rows[number] = rows
    state.pictures[number] = measured.best
    fit_into_route(state, number)


def _grow_hold(
    snapshot: ScanSnapshot, labels: NDArray[np.int32], at: NDArray[np.float64], radius: float
) -> _Measured:
    """Return the triangles of a hold at a place, and its measurement."""
    crops = view_crops(snapshot, at, radius, snapshot.settings.photos)
    return _with_measurement(snapshot, labels, grow(snapshot, labels, at, radius, crops), crops)


def _find_solid(
    snapshot: ScanSnapshot, labels: NDArray[np.int32], at: NDArray[np.float64], radius: float
) -> _Measured:
    """Return the triangles of the volume at a place, and its measurement."""
    rows = solid_at(snapshot, labels, at)
    places = snapshot.mesh.centroids[rows]
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    reach = min(radius, float(np.linalg.norm(places - middle, axis=1).max()))
    crops = view_crops(snapshot, middle, reach, snapshot.settings.photos)
    return _with_measurement(snapshot, labels, rows, crops)


def _with_measurement(
    snapshot: ScanSnapshot,
    labels: NDArray[np.int32],
    rows: NDArray[np.int64],
    crops: Sequence[ViewCrop],
) -> _Measured:
    """Return triangles with their measurement in photos."""
    own = np.where(labels > 0, -1, 0).astype(np.int32)
    own[rows] = 1
    (shape,) = measure_shapes(snapshot.mesh, own, [1]).values()
    return rows, measure_hold(snapshot, own, shape, crops)


def merge(state: EditState, edit: Merge) -> None:
    """Merge routes under the id of the first one, which keeps its facts."""
    routes = list(dict.fromkeys(state.route(ref) for ref in edit.routes))
    if len(routes) < 2:
        raise MissingError("routes_one", *(ref.id for ref in edit.routes))
    first, *others = routes
    for hold, route in state.route_of.items():
        if route in routes:
            state.route_of[hold] = first
            state.decided.add(hold)
    for route in others:
        state.facts.pop(route, None)
        for hold in state.shared.pop(route, []):
            state.share(hold, first)
    for (route, hold), role in list(state.roles.items()):
        if route in others:
            del state.roles[route, hold]
            state.roles.setdefault((first, hold), role)


def split(state: EditState, edit: Split) -> None:
    """Move holds, with their roles, from their route to a new one."""
    holds = list(dict.fromkeys(_single_route_hold(state, ref) for ref in edit.holds))
    left = {state.route_of[hold] for hold in holds if hold in state.route_of}
    state.decided.update(hold for hold, route in state.route_of.items() if route in left)
    new = state.new_route(edit.new)
    for hold in holds:
        role = state.roles.get((state.route_of.get(hold, 0), hold))
        state.place(hold, new)
        if role is not None:
            state.roles[new, hold] = role
        state.decided.add(hold)
    _forget_empty(state, left)


def assign(state: EditState, edit: Assign) -> None:
    """Assign a hold to a route, or to none."""
    hold = _single_route_hold(state, edit.hold)
    left = {state.route_of.get(hold, 0)}
    if edit.route.id == 0:
        left = {*state.routes_of(hold)}
        for route in left:
            state.leave(hold, route)
    else:
        state.place(hold, state.route(edit.route))
        # A downclimb hold that a setter puts into a route becomes an ordinary hold.
        state.holds[hold] = replace(state.holds[hold], role="hold")
    state.decided.add(hold)
    _forget_empty(state, left)


def set_problem(state: EditState, edit: SetProblem) -> None:
    """Make a new route of holds that stay in their own routes."""
    hands = list(dict.fromkeys(_single_route_hold(state, ref) for ref in edit.hands))
    by_role: tuple[tuple[RoleName, tuple[Ref, ...]], ...] = (
        ("foot", edit.feet),
        ("start", edit.start),
        ("top", edit.top),
    )
    roles: dict[int, RoleName] = dict.fromkeys(hands, "hand")
    for role, refs in by_role:
        roles |= dict.fromkeys((_single_route_hold(state, ref) for ref in refs), role)
    number = state.new_route(edit.new)
    for hold, role in roles.items():
        state.share(hold, number)
        state.roles[number, hold] = role
    state.facts[number] = RouteFacts(proposed=edit.proposed)


def share(state: EditState, edit: Share) -> None:
    """Add a hold to a route beside its own."""
    state.share(_single_route_hold(state, edit.hold), state.route(edit.route))


def leave(state: EditState, edit: Leave) -> None:
    """Remove a hold from a route."""
    hold, route = state.hold(edit.hold).id, state.route(edit.route)
    if route not in state.routes_of(hold):
        raise MissingError("other_route", edit.hold.id, edit.route.id)
    state.leave(hold, route)
    state.decided.add(hold)
    _forget_empty(state, {route})


def set_route(state: EditState, edit: SetRoute) -> None:
    """Set facts of a route; an empty text removes a fact."""
    route = state.route(edit.route)
    changes = {
        name: getattr(edit, name)
        for name in RouteFacts.__dataclass_fields__
        if getattr(edit, name) is not None
    }
    state.facts[route] = dataclasses.replace(state.facts.get(route, RouteFacts()), **changes)


def set_role(state: EditState, edit: SetRole) -> None:
    """Set a hold's role in its route."""
    hold, route = state.hold(edit.hold), state.route(edit.route)
    if hold.role != "volume" and route not in state.routes_of(hold.id):
        raise MissingError("other_route", edit.hold.id, edit.route.id)
    state.roles[route, hold.id] = edit.role


def _single_route_hold(state: EditState, ref: Ref) -> int:
    """Return the id of a hold that may belong to a single route."""
    hold = state.hold(ref)
    if hold.role == "volume":
        raise MissingError("volume", ref.id)
    return hold.id


def _forget_empty(state: EditState, routes: set[int]) -> None:
    """Drop the facts and roles of routes that have no hold left."""
    for route in routes - state.routes:
        state.facts.pop(route, None)
        for key in [key for key in state.roles if key[0] == route]:
            del state.roles[key]


def paint(state: EditState, edit: Paint) -> None:
    """Assign the triangles in a ball to a hold, or to the wall."""
    number = state.hold(edit.hold).id if edit.hold.id else 0
    state.relabel(state.snapshot.triangles.within(edit.at, edit.radius_m), number)


def hide(state: EditState, edit: Hide) -> None:
    """Hide a ball around a place."""
    state.hidden = (*state.hidden, HiddenPlace(edit.at, edit.radius_m))


def unhide(state: EditState, edit: Unhide) -> None:
    """Show a hidden place again."""
    left = without_place(state.hidden, edit)
    if len(left) == len(state.hidden):
        raise MissingError("not_hidden")
    state.hidden = left


def cut(state: EditState, edit: Cut) -> None:
    """Cut a hold along a line, as seen along its normal; the larger part keeps the id.

    The new part joins the route of the hold. If `remeasure` finds that it has another colour, it
    moves to the route that it fits.
    """
    hold, mesh = state.hold(edit.hold), state.snapshot.mesh
    start, end = np.array(edit.points)
    across = np.cross(end - start, hold.normal)
    if np.linalg.norm(across) < 1e-9:
        raise MissingError("no_line")
    rows = np.flatnonzero(state.labels == hold.id)
    side = (mesh.centroids[rows] - start) @ across > 0
    if side.all() or not side.any():
        raise MissingError("beside", edit.hold.id)
    if mesh.areas[rows[side]].sum() > mesh.areas[rows[~side]].sum():
        side = ~side
    new = state.new_hold(edit.new)
    state.holds[new] = replace(hold, id=new, review=False)
    state.cut_off.add(new)
    route = state.route_of.get(hold.id, 0)
    state.relabel(rows[side], new)
    state.place(new, route)


def join(state: EditState, edit: Join) -> None:
    """Join instances under the id of the first one, which keeps its attributes.

    If the first one has no route or role, it gets those of the first other that has.
    """
    numbers = list(dict.fromkeys(state.hold(ref).id for ref in edit.holds))
    if len(numbers) < 2:
        raise MissingError("holds_one", *(ref.id for ref in edit.holds))
    first, *others = numbers
    routes = [state.route_of[number] for number in numbers if number in state.route_of]
    roles = {key: role for key, role in state.roles.items() if key[1] in numbers}
    rows = np.flatnonzero(np.isin(state.labels, others))
    for number in others:
        state.drop(number)
    state.relabel(rows, first)
    if routes and state.holds[first].role == "hold":
        state.place(first, routes[0])
    for (route, _), role in roles.items():
        if route == state.route_of.get(first):
            state.roles.setdefault((route, first), role)
