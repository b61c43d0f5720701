"""Find the route that a new or recoloured hold fits, if no setter placed it."""

from __future__ import annotations

import numpy as np

from walltopo.describe.routes.find import STRONGEST, colour_of, paints_of
from walltopo.describe.routes.grouping import FLATTEN, strongest_links
from walltopo.editing.state import EditState
from walltopo.scans.holds import UNKNOWN


def route_colour(state: EditState, route: int) -> str:
    """Return the name of a route's colour: the setter's, or that of most of its holds."""
    facts = state.facts.get(route)
    return facts.colour if facts and facts.colour else colour_of(state.members(route))[0]


def fit_into_route(state: EditState, number: int) -> None:
    """Put a hold into the route of one of its colours that it fits best, by `strongest_links`.

    The hold gets no route if no such route has a hold near enough. Paths are straight lines here,
    because the hold is close to those that it is compared with.
    """
    hold, unit = state.holds[number], state.snapshot.unit
    state.place(number, 0)
    if hold.role != "hold" or hold.colour == UNKNOWN:
        return
    others = [other for other in state.holds.values() if other.role == "hold" and other != hold]
    routes = [state.route_of.get(other.id, 0) for other in others]
    wanted = {route for route in set(routes) - {0} if route_colour(state, route) in hold.colours}
    rows = [row for row, route in enumerate(routes, start=1) if route in wanted]
    if not rows:
        return
    holds = [hold, *others]
    points = np.array([other.position for other in holds]) / unit
    pairs = np.column_stack([np.zeros(len(rows), dtype=np.int64), rows])
    flat = points * np.array([1.0, 1.0, FLATTEN])
    lengths = np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1)
    links = strongest_links(points, *paints_of(holds), pairs, lengths)
    group = np.array([routes[row - 1] for row in rows])
    fits = {
        route: float(np.sort(links[group == route])[-STRONGEST:].sum()) for route in sorted(wanted)
    }
    best = max(fits, key=lambda route: fits[route])
    if fits[best] > 0:
        state.place(number, best)
