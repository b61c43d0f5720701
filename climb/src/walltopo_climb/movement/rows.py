"""Compute the moves of climbers of several heights: rows of `moves.json`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from walltopo.scans.holds import Hold
from walltopo.scans.moves import ClimberRow, MoveRow
from walltopo.scans.routes import Route
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.on_wall import climb_of, on_route
from walltopo_climb.movement.sequence import Sequence as Moves
from walltopo_climb.movement.sequence import find_sequence


def climber_rows(
    route: Route, holds: Sequence[Hold], unit: float, bodies: Mapping[str, Body]
) -> tuple[ClimberRow, ...]:
    """Return a row for each body, by its name; empty if the route is no climb.

    Parameters
    ----------
    holds : all holds of the wall. unit : scan units per metre.
    """
    used = on_route(route, holds, unit)
    climb = climb_of(route, used, unit)
    if climb is None:
        return ()
    ids = [hold.id for hold in used]
    rows = []
    for name, body in bodies.items():
        found = find_sequence(climb, body)
        rows.append(
            ClimberRow(
                climber=name,
                height=body.height,
                span=body.span,
                reached=found is not None and found.reached,
                crux=0 if found is None else found.crux,
                moves=() if found is None else _moves(found, ids, unit),
            )
        )
    return tuple(rows)


def _moves(sequence: Moves, ids: list[int], unit: float) -> tuple[MoveRow, ...]:
    rows = []
    for move in sequence.moves:
        a, b, c, d = (ids[i] if i >= 0 else 0 for i in move.limbs)
        x, y, z = (round(value * unit, 4) for value in move.hip)
        rows.append(
            MoveRow(
                limb=move.limb or "start",
                holds=(a, b, c, d),
                hip=(x, y, z),
                effort=round(move.effort, 3),
                beyond=round(move.beyond, 3),
            )
        )
    return tuple(rows)
