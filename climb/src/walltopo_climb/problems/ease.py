"""One grade easier, or harder: which hold that hangs nearby to add to a route, or to take away."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from msgspec.structs import replace

from walltopo.core import InputError
from walltopo.scans.routes import Route, route_name
from walltopo_climb.grades.of_scan import Climbed, Scale, climb_route
from walltopo_climb.movement.body import BODIES
from walltopo_climb.movement.rows import climber_rows
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.rows import Do, Tweak, Tweaks
from walltopo_climb.problems.search import grade_row

Way = Literal["easier", "harder"]

_NEAR = 0.8  # m: a hold farther from every hold of the route is none that one would think of
_LEAST = 0.25  # grades: less is no change that the model could tell
_EASES = 0.05  # share of the effort of the hardest move: less is none
_MOST_SHOWN = 5


def ease(pool: Pool, route: Route, routes: Sequence[Route], scale: Scale, way: Way) -> Tweaks:
    """The holds that change a route by about one grade.

    A hold that is added can only make it easier and one that is taken away only harder: what the
    grade model says against that is its own unevenness, and left out. So is what leaves the effort
    of the movement as it was.

    Parameters
    ----------
    routes : of the wall; holds of others may be shared. way : "easier" or "harder".

    Raises
    ------
    InputError : an adult does not get up the route as it is.
    """
    before = climb_route(route, pool.near(route.holds), pool.unit)
    if before is None or not before.moves.reached:
        raise InputError(
            f"route {route.id} ({route_name(route)}): no way to its top is found",
            "Check its start, its top and the roles of its holds in the editor.",
        )
    place = _place(before, scale)
    wanted = -1.0 if way == "easier" else 1.0
    found: list[tuple[float, Route, Tweak]] = []
    tried = 0
    changes = _added(pool, route) if way == "easier" else _taken_away(route)
    for do, hold, changed in changes:
        tried += 1
        after = climb_route(changed, pool.near(changed.holds), pool.unit)
        if after is None or not after.moves.reached:
            continue
        by = scale.grade(_place(after, scale), after.known) - scale.grade(place, before.known)
        effort = _effort(after) - _effort(before)
        if by * wanted < _LEAST or effort * wanted <= 0:
            continue
        on = next((r.id for r in routes if hold in r.holds and r.id != route.id), 0)
        crux, eases = _crux(before, after)
        row = grade_row(scale.range(_place(after, scale), after.known))
        tweak = Tweak(do, hold, on, round(by, 2), row, crux, eases, ())
        found.append((abs(by - wanted) + _later(tweak), changed, tweak))
    found.sort(key=lambda item: (item[0], item[2].hold))
    shown = tuple(_shown(pool, changed, tweak) for _, changed, tweak in found[:_MOST_SHOWN])
    now = grade_row(scale.range(place, before.known))
    return Tweaks(pool.unit, route.id, now, tried, shown)


def _shown(pool: Pool, changed: Route, tweak: Tweak) -> Tweak:
    climbers = climber_rows(changed, pool.near(changed.holds), pool.unit, BODIES)
    return replace(tweak, climbers=climbers)


def _later(tweak: Tweak) -> float:
    """What eases the crux comes first, and what hangs on no other route: climbers must be told."""
    return 0.3 * (abs(tweak.eases) < _EASES) + 0.2 * (tweak.on > 0)


def _added(pool: Pool, route: Route) -> Iterator[tuple[Do, int, Route]]:
    """What hangs nearby, with the hold and the route afterwards."""
    own = [pool.row_of[number] for number in route.holds if number in pool.row_of]
    if not own:
        return
    near = np.flatnonzero(pool.apart[own].min(axis=0) < _NEAR)
    top = max(pool.place[pool.row_of[number], 2] for number in route.top)
    for row in near:
        number = int(pool.ids[row])
        if number in route.holds or pool.place[row, 2] > top:
            continue
        wider = replace(route, holds=(*route.holds, number))
        yield "add a foothold", number, replace(wider, footholds=(*route.footholds, number))
        if pool.hands[row]:
            yield "add a handhold", number, wider


def _taken_away(route: Route) -> Iterator[tuple[Do, int, Route]]:
    """The holds between start and top, with the route afterwards."""
    for number in set(route.holds) - {*route.start, *route.top}:
        yield (
            "take away",
            number,
            replace(
                route,
                holds=tuple(other for other in route.holds if other != number),
                footholds=tuple(other for other in route.footholds if other != number),
            ),
        )


def _place(climbed: Climbed, scale: Scale) -> float:
    return float(scale.model.places(climbed.features[None])[0])


def _effort(climbed: Climbed) -> float:
    """Of the hardest move, and a little of all: where the hardest stays the same, they count."""
    moves = climbed.moves.moves
    return moves[climbed.moves.crux].effort + 0.1 * sum(move.effort for move in moves)


def _crux(before: Climbed, after: Climbed) -> tuple[int, float]:
    """The hold that the hardest move goes to, and how much less effort the hardest move takes."""
    move = before.moves.moves[before.moves.crux]
    now = after.moves.moves[after.moves.crux]
    hold = before.holds[move.to].id if move.limb is not None else 0
    return hold, round(1 - now.effort / max(move.effort, 1e-9), 3)
