"""Find the holds whose addition brings shorter climbers to the top of a problem."""

from __future__ import annotations

from itertools import islice
from typing import Final

import msgspec

from walltopo.scans.routes import Route
from walltopo_climb.movement.reach import HEIGHTS, reached_of, reaching_heights
from walltopo_climb.problems.adjust_grade import nearby_additions
from walltopo_climb.problems.pool import Pool

_MAX_TRIED: Final = 80  # additions, nearest first; each costs a search of moves or more
_MAX_SHOWN: Final = 3


class Opening(msgspec.Struct, frozen=True):
    """A hold that opens a problem to shorter climbers.

    Parameters
    ----------
    hold : its id. foot : it is added for feet alone.
    height : in metres, of the shortest climber who reaches the top with it.
    """

    hold: int
    foot: bool
    height: float


def find_openings(pool: Pool, route: Route) -> tuple[Opening, ...]:
    """Return the holds that open a problem to shorter climbers, the best first; none if all of
    `HEIGHTS` reach the top.

    Parameters
    ----------
    pool : the wall's holds. route : the problem.
    """
    reached = reaching_heights(route, pool.near(route.holds), pool.unit)
    lowest = min(reached or (), default=HEIGHTS[-1] + 1)
    missing = [height for height in reversed(HEIGHTS) if height < lowest]
    if reached is None or not missing:
        return ()
    best: dict[int, Opening] = {}
    for do, hold, wider in islice(nearby_additions(pool, route), _MAX_TRIED):
        heights = reached_of(missing, wider, pool.near(wider.holds), pool.unit)
        if heights:
            found = Opening(hold, do == "add a foothold", heights[-1])
            best[hold] = min(best.get(hold, found), found, key=_opening_rank)
    return tuple(sorted(best.values(), key=_opening_rank)[:_MAX_SHOWN])


def _opening_rank(opening: Opening) -> tuple[float, bool, int]:
    """Shorter climbers first; a foothold changes a problem less than a hold for hands."""
    return opening.height, not opening.foot, opening.hold
