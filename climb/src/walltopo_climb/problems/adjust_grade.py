"""Find the hold to add to a route, or to remove, for one grade easier or harder."""

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

Direction = Literal["easier", "harder"]

_NEAR = 0.8  # m: a hold farther from every hold of the route is not considered
_MIN_CHANGE = 0.25  # grades: a smaller change is within the model's noise
_MIN_EASING = 0.05  # share of the hardest move's effort: a smaller change ranks lower
_MAX_SHOWN = 5


def adjust_grade(
    pool: Pool, route: Route, routes: Sequence[Route], scale: Scale, direction: Direction
) -> Tweaks:
    """Return the holds that change a route by about one grade.

    An added hold can only make a route easier, and a removed one only harder. Contrary estimates
    are artefacts of the grade model and are omitted, as are changes without effect on the effort of
    the movement.

    Parameters
    ----------
    routes : of the wall; their holds may be shared. direction : "easier" or "harder".

    Raises
    ------
    InputError : an adult cannot climb the route as it is.
    """
    before = climb_route(route, pool.near(route.holds), pool.unit)
    if before is None or not before.moves.reached:
        raise InputError(
            f"route {route.id} ({route_name(route)}): found no sequence to its top",
            "Check its start, its top and the roles of its holds in the editor.",
        )
    difficulty = _difficulty_of(before, scale)
    wanted = -1.0 if direction == "easier" else 1.0
    found: list[tuple[float, Route, Tweak]] = []
    tried = 0
    changes = (
        nearby_additions(pool, route) if direction == "easier" else _routes_without_hold(route)
    )
    for do, hold, changed in changes:
        tried += 1
        after = climb_route(changed, pool.near(changed.holds), pool.unit)
        if after is None or not after.moves.reached:
            continue
        by = scale.grade(_difficulty_of(after, scale), after.known) - scale.grade(
            difficulty, before.known
        )
        effort = _total_effort(after) - _total_effort(before)
        if by * wanted < _MIN_CHANGE or effort * wanted <= 0:
            continue
        on = next((r.id for r in routes if hold in r.holds and r.id != route.id), 0)
        crux, eases = _hardest_move(before, after)
        row = grade_row(scale.range(_difficulty_of(after, scale), after.known))
        tweak = Tweak(do, hold, on, round(by, 2), row, crux, eases, ())
        found.append((abs(by - wanted) + _change_penalty(tweak), changed, tweak))
    found.sort(key=lambda item: (item[0], item[2].hold))
    shown = tuple(_with_climbers(pool, changed, tweak) for _, changed, tweak in found[:_MAX_SHOWN])
    now = grade_row(scale.range(difficulty, before.known))
    return Tweaks(pool.unit, route.id, now, tried, shown)


def _with_climbers(pool: Pool, changed: Route, tweak: Tweak) -> Tweak:
    climbers = climber_rows(changed, pool.near(changed.holds), pool.unit, BODIES)
    return replace(tweak, climbers=climbers)


def _change_penalty(tweak: Tweak) -> float:
    """Return a penalty, in grades, for changes away from the crux and for holds of other routes."""
    return 0.3 * (abs(tweak.eases) < _MIN_EASING) + 0.2 * (tweak.on > 0)


def nearby_additions(pool: Pool, route: Route) -> Iterator[tuple[Do, int, Route]]:
    """Yield each nearby hold, the nearest first, with the route that includes it."""
    own = [pool.row_of[number] for number in route.holds if number in pool.row_of]
    if not own:
        return
    away = pool.distances[own].min(axis=0)
    top = max((pool.by_id[number].position[2] - pool.floor) / pool.unit for number in route.top)
    for row in np.argsort(away, kind="stable")[: int((away < _NEAR).sum())]:
        number = int(pool.ids[row])
        if number in route.holds or pool.position[row, 2] > top:
            continue
        wider = replace(route, holds=(*route.holds, number))
        yield "add a foothold", number, replace(wider, footholds=(*route.footholds, number))
        if pool.hands[row]:
            yield "add a handhold", number, wider


def _routes_without_hold(route: Route) -> Iterator[tuple[Do, int, Route]]:
    """Yield each hold between start and top with the route without it."""
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


def _difficulty_of(climbed: Climbed, scale: Scale) -> float:
    return float(scale.model.difficulties(climbed.features[None])[0])


def _total_effort(climbed: Climbed) -> float:
    """Return the effort of the hardest move plus a tenth of the total, as a tie-breaker."""
    moves = climbed.moves.moves
    return moves[climbed.moves.crux].effort + 0.1 * sum(move.effort for move in moves)


def _hardest_move(before: Climbed, after: Climbed) -> tuple[int, float]:
    """Return the target hold of the hardest move, and the share of effort that it saves."""
    move = before.moves.moves[before.moves.crux]
    now = after.moves.moves[after.moves.crux]
    hold = before.holds[move.to].id if move.limb is not None else 0
    return hold, round(1 - now.effort / max(move.effort, 1e-9), 3)
