"""The log, entry by entry, on what the scan found; and what comes out of it."""

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
from walltopo.describe.routes.order import describe_route
from walltopo.describe.routes.start_and_top import Wall, wall_of
from walltopo.editing.entries import (
    add,
    assign,
    cut,
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
)
from walltopo.editing.notes import MissingError, Note
from walltopo.editing.remeasure import read_again, with_shape
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.state import EditState, RouteFacts
from walltopo.scans.attributes import Attributes, Doubtful
from walltopo.scans.document import Rgb
from walltopo.scans.edits import (
    Add,
    Assign,
    Cut,
    Edit,
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
)
from walltopo.scans.holds import Holds, hold_rows
from walltopo.scans.routes import Ambiguous, Route, Routes

_KINDS: dict[type[Any], Callable[[EditState, Any], None]] = {
    Add: add,
    Assign: assign,
    Cut: cut,
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
}


@dataclass(frozen=True, eq=False)
class Outcome:
    """The scan after a log of edits.

    Parameters
    ----------
    labels : (F,) int32; those of instances that are no holds are among them.
    left_out : instances that are no holds, with all that is known of them.
    pictures : of holds that were read in photos after an edit, by id.
    notes : what could not be applied, and why.
    """

    attributes: Attributes
    routes: Routes
    holds: Holds
    labels: NDArray[np.int32]
    left_out: tuple[Doubtful, ...]
    pictures: Mapping[int, HoldView | None]
    notes: tuple[Note, ...]


def replay(scanned: ScanSnapshot, edits: Sequence[Edit]) -> Outcome:
    """Apply a log from its first entry to its last, on the scan as it was found.

    An entry that finds nothing is left out and told; it never fails a run.
    """
    board = EditState.of(scanned)
    notes = []
    for number, edit in enumerate(edits, start=1):
        try:
            _KINDS[type(edit)](board, edit)
        except MissingError as reason:
            name = str(type(edit).__struct_config__.tag)
            notes.append(Note.of(number, name, reason))
    return _outcome(board, notes)


def _outcome(board: EditState, notes: Sequence[Note]) -> Outcome:
    _measure(board)
    holds = tuple(board.holds[number].rounded() for number in sorted(board.holds))
    wall = _wall(board)
    routes = tuple(_route(board, number, wall) for number in sorted(board.routes))
    unrouted = [h.id for h in holds if h.role == "hold" and not board.routes_of(h.id)]
    volumes = [hold.id for hold in holds if hold.role == "volume"]
    out = tuple(board.out.values())
    return Outcome(
        attributes=Attributes(
            palette=board.scanned.found.palette,
            instances=holds,
            left_out=tuple(row.row() for row in out),
            unit=board.scanned.unit,
        ),
        routes=Routes(routes=routes, unrouted=tuple(unrouted), volumes=tuple(volumes)),
        holds=Holds(
            metric=board.scanned.metric,
            unit=board.scanned.unit,
            holds=hold_rows(holds, board.scores, _owners_first(board, routes)),
        ),
        labels=board.labels,
        left_out=out,
        pictures=board.pictures,
        notes=tuple(notes),
    )


def _owners_first(board: EditState, routes: Sequence[Route]) -> tuple[Route, ...]:
    """Routes that only share holds after all others: a hold's row names its own route."""
    own = set(board.route_of.values())
    return tuple(sorted(routes, key=lambda route: route.id not in own))


def _measure(board: EditState) -> None:
    """Place, size and wall angle of the instances whose triangles changed; colour, type of some."""
    known = board.reshaped & (board.holds.keys() | board.out.keys())
    if not known:
        return
    mesh = board.scanned.mesh
    # What is guessed counts in no measure.
    measured = board.labels[mesh.measured]
    shapes = measure_shapes(mesh.without_guesses(), measured, sorted(known))
    for number, shape in shapes.items():
        if number in board.holds:
            board.holds[number] = with_shape(board.holds[number], shape)
            read_again(board, number, shape)
        else:
            row = board.out[number]
            board.out[number] = replace(row, hold=with_shape(row.hold, shape))


def _wall(board: EditState) -> Wall:
    """What is usual on the wall: by what the scan found, beside the holds as they are now."""
    instances = board.scanned.found.instances
    found = {hold.id: hold for hold in instances}
    routes = [[found[number] for number in route.holds] for route in board.scanned.routes.routes]
    free = (hold for hold in board.holds.values() if hold.id not in board.route_of)
    return wall_of(routes, instances).beside(free, board.out.values())


def _route(board: EditState, number: int, wall: Wall) -> Route:
    """A route as the routes stage describes it, and what a setter says of it."""
    roles = {hold: role for (route, hold), role in board.roles.items() if route == number}
    doubts = _ambiguous(board, number)
    found = describe_route(number, board.members(number), wall, doubts, roles)
    said = board.facts.get(number, RouteFacts())
    colour = said.colour or _colour(board, found)
    return replace(
        found,
        name=said.name,
        colour=colour,
        colour_rgb=found.colour_rgb if colour == found.colour else _looks(board, colour),
        grade=said.grade,
        setter=said.setter,
        description=said.description,
        date=said.date,
        proposed=said.proposed,
    )


def _colour(board: EditState, found: Route) -> str:
    """That of its holds; none of a route on holds of others, of several colours."""
    colours = {board.holds[hold].colour for hold in found.holds}
    shares = found.id in board.shared and found.id not in board.route_of.values()
    return "" if shares and len(colours) > 1 else found.colour


def _looks(board: EditState, colour: str) -> Rgb:
    """What a colour looks like on this wall: of its holds, of its palette, else as usual."""
    paints = [hold.colour_rgb for hold in board.holds.values() if hold.colour == colour]
    if paints:
        red, green, blue = np.median(paints, axis=0).round().astype(int).tolist()
        return red, green, blue
    named = {entry.name: entry.rgb for entry in board.scanned.found.palette}
    return named.get(colour, REFERENCE.get(colour, (128, 128, 128)))


def _ambiguous(board: EditState, number: int) -> dict[int, dict[int, float]]:
    """Of the scan's doubts about a route's holds, those that no setter has settled."""
    alive = board.routes
    rows: dict[int, dict[int, float]] = {}
    for row in _doubts(board, number):
        shares = {int(route): share for route, share in row.routes.items() if int(route) in alive}
        if len(shares) > 1:
            rows[row.hold] = shares
    return rows


def _doubts(board: EditState, number: int) -> list[Ambiguous]:
    return [
        row
        for route in board.scanned.routes.routes
        for row in route.ambiguous
        if row.hold not in board.decided
        and board.route_of.get(row.hold) == number
        and route.id == number
    ]
