"""Replay the log, entry by entry, on the scan before any edit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.geometry import measure_shapes
from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.palette import REFERENCE
from walltopo.describe.routes.find import describe_route
from walltopo.describe.routes.start_and_top import WallStats, wall_stats
from walltopo.editing.entries import (
    add,
    assign,
    cut,
    hide,
    join,
    keep,
    leave,
    merge,
    paint,
    remove,
    set_hold,
    set_problem,
    set_role,
    set_route,
    share,
    split,
    unhide,
)
from walltopo.editing.messages import MissingError, Note
from walltopo.editing.remeasure import remeasure, with_shape
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.state import EditState, RouteFacts
from walltopo.scans.document import Rgb
from walltopo.scans.edits import (
    Add,
    Assign,
    Cut,
    Edit,
    Hide,
    Join,
    Keep,
    Leave,
    Merge,
    Paint,
    Remove,
    SetHold,
    SetProblem,
    SetRole,
    SetRoute,
    Share,
    Split,
    Unhide,
)
from walltopo.scans.hidden import HiddenPlace
from walltopo.scans.holds import Holds, with_routes
from walltopo.scans.routes import Ambiguous, Route, Routes

_KINDS: dict[type[Any], Callable[[EditState, Any], None]] = {
    Add: add,
    Assign: assign,
    Cut: cut,
    Hide: hide,
    Join: join,
    Keep: keep,
    Leave: leave,
    Merge: merge,
    Paint: paint,
    Remove: remove,
    SetHold: set_hold,
    SetProblem: set_problem,
    SetRole: set_role,
    SetRoute: set_route,
    Share: share,
    Split: split,
    Unhide: unhide,
}


@dataclass(frozen=True, eq=False)
class Outcome:
    """The scan after a log of edits.

    Parameters
    ----------
    labels : (F,) int32, including the labels of low-confidence instances.
    pictures : views of holds that an edit remeasured in photos, by id.
    hidden : places that are hidden in texture and photos.
    notes : entries that were skipped, with the reason.
    """

    routes: Routes
    holds: Holds
    labels: NDArray[np.int32]
    pictures: Mapping[int, HoldView | None]
    hidden: tuple[HiddenPlace, ...]
    notes: tuple[Note, ...]


def replay(snapshot: ScanSnapshot, edits: Sequence[Edit]) -> Outcome:
    """Return the scan after a log, applied from its first entry to its last.

    An entry that refers to something missing becomes a note; it never fails a run.
    """
    state = EditState.of(snapshot)
    notes = []
    for number, edit in enumerate(edits, start=1):
        try:
            _KINDS[type(edit)](state, edit)
        except MissingError as reason:
            name = str(type(edit).__struct_config__.tag)
            notes.append(Note.of(number, name, reason))
    return _outcome(state, notes)


def _outcome(state: EditState, notes: Sequence[Note]) -> Outcome:
    _remeasure_holds(state)
    holds = tuple(state.holds[number].rounded() for number in sorted(state.holds))
    wall = _wall_stats(state)
    routes = tuple(_describe_route(state, number, wall) for number in sorted(state.routes))
    unrouted = [h.id for h in holds if h.role == "hold" and not state.routes_of(h.id)]
    volumes = [hold.id for hold in holds if hold.role == "volume"]
    return Outcome(
        routes=Routes(routes=routes, unrouted=tuple(unrouted), volumes=tuple(volumes)),
        holds=replace(
            state.snapshot.found,
            holds=with_routes(holds, _owners_first(state, routes)),
            left_out=tuple(hold.rounded() for hold in state.non_holds.values()),
        ),
        labels=state.labels,
        pictures=state.pictures,
        hidden=state.hidden,
        notes=tuple(notes),
    )


def _owners_first(state: EditState, routes: Sequence[Route]) -> tuple[Route, ...]:
    """Return the routes, those that only share holds last: a hold's row names its own route."""
    own = set(state.route_of.values())
    return tuple(sorted(routes, key=lambda route: route.id not in own))


def _remeasure_holds(state: EditState) -> None:
    """Update position, size and wall angle of reshaped instances; colour and type of some."""
    known = state.reshaped & (state.holds.keys() | state.non_holds.keys())
    if not known:
        return
    mesh = state.snapshot.mesh
    # Guessed triangles do not count in sizes and areas.
    measured = state.labels[mesh.measured]
    shapes = measure_shapes(mesh.without_guesses(), measured, sorted(known))
    for number, shape in shapes.items():
        if number in state.holds:
            state.holds[number] = with_shape(state.holds[number], shape)
            remeasure(state, number, shape)
        else:
            state.non_holds[number] = with_shape(state.non_holds[number], shape)


def _wall_stats(state: EditState) -> WallStats:
    """Return the usual figures of the scan's routes, with the present strays."""
    instances = state.snapshot.found.holds
    found = {hold.id: hold for hold in instances}
    routes = [[found[number] for number in route.holds] for route in state.snapshot.routes.routes]
    free = (hold for hold in state.holds.values() if hold.id not in state.route_of)
    return wall_stats(routes, instances).with_strays(free, state.non_holds.values())


def _describe_route(state: EditState, number: int, wall: WallStats) -> Route:
    """Return a route as the stage `routes` describes it, with the setter's facts."""
    roles = {hold: role for (route, hold), role in state.roles.items() if route == number}
    ambiguous = _ambiguous_holds(state, number)
    found = describe_route(number, state.members(number), wall, ambiguous, roles)
    by_setter = state.facts.get(number, RouteFacts())
    colour = by_setter.colour or _common_colour(state, found)
    return replace(
        found,
        name=by_setter.name,
        colour=colour,
        colour_rgb=found.colour_rgb if colour == found.colour else _rgb_of(state, colour),
        grade=by_setter.grade,
        setter=by_setter.setter,
        description=by_setter.description,
        date=by_setter.date,
        proposed=by_setter.proposed,
    )


def _common_colour(state: EditState, found: Route) -> str:
    """Return the colour of the holds; empty for a route of shared holds of several colours."""
    colours = {state.holds[hold].colour for hold in found.holds}
    shares = found.id in state.shared and found.id not in state.route_of.values()
    return "" if shares and len(colours) > 1 else found.colour


def _rgb_of(state: EditState, colour: str) -> Rgb:
    """Return the RGB of a colour name: from the holds, else the palette, else the reference."""
    paints = [hold.colour_rgb for hold in state.holds.values() if hold.colour == colour]
    if paints:
        red, green, blue = np.median(paints, axis=0).round().astype(int).tolist()
        return red, green, blue
    named = {entry.name: entry.rgb for entry in state.snapshot.found.palette}
    return named.get(colour, REFERENCE.get(colour, (128, 128, 128)))


def _ambiguous_holds(state: EditState, number: int) -> dict[int, dict[int, float]]:
    """Return the ambiguous holds of a route that no setter has settled, with probabilities."""
    alive = state.routes
    rows: dict[int, dict[int, float]] = {}
    for row in _unsettled(state, number):
        shares = {int(route): share for route, share in row.routes.items() if int(route) in alive}
        if len(shares) > 1:
            rows[row.hold] = shares
    return rows


def _unsettled(state: EditState, number: int) -> list[Ambiguous]:
    return [
        row
        for route in state.snapshot.routes.routes
        for row in route.ambiguous
        if row.hold not in state.decided
        and state.route_of.get(row.hold) == number
        and route.id == number
    ]
