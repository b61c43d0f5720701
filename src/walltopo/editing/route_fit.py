"""Which route a hold fits, where nobody has said so: a hold that is new, or of another colour."""

from __future__ import annotations

import numpy as np

from walltopo.describe.routes.grouping import FLATTEN, balanced_paint, cues_of, likeness
from walltopo.describe.routes.order import STRONGEST, colour_of
from walltopo.editing.state import EditState
from walltopo.images.colour import linear_from_srgb8
from walltopo.scans.attributes import UNKNOWN


def route_colour(board: EditState, route: int) -> str:
    """The name of a route's colour: a setter's, or that of most of its holds."""
    facts = board.facts.get(route)
    return facts.colour if facts and facts.colour else colour_of(board.members(route))[0]


def fit_into_route(board: EditState, number: int) -> None:
    """Put a hold into the route of its colour that it fits best, by the links of `routes.paint`.

    Into none where no route of its colour has a hold near enough. Paths are taken straight: the
    hold stands beside those that it is compared with.
    """
    hold, unit = board.holds[number], board.scanned.unit
    board.place(number, 0)
    if hold.role != "hold" or hold.colour == UNKNOWN:
        return
    others = [other for other in board.holds.values() if other.role == "hold" and other != hold]
    routes = [board.route_of.get(other.id, 0) for other in others]
    wanted = {route for route in set(routes) - {0} if route_colour(board, route) == hold.colour}
    rows = [row for row, route in enumerate(routes, start=1) if route in wanted]
    if not rows:
        return
    holds = [hold, *others]
    points = np.array([other.position for other in holds]) / unit
    linear = linear_from_srgb8(np.array([other.colour_rgb for other in holds], dtype=np.uint8))
    paint = balanced_paint(linear, np.array([other.wall_tint for other in holds]))
    pairs = np.column_stack([np.zeros(len(rows), dtype=np.int64), rows])
    flat = points * np.array([1.0, 1.0, FLATTEN])
    lengths = np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1)
    links = likeness(cues_of(points, paint, pairs, lengths))
    group = np.array([routes[row - 1] for row in rows])
    fits = {
        route: float(np.sort(links[group == route])[-STRONGEST:].sum()) for route in sorted(wanted)
    }
    best = max(fits, key=lambda route: fits[route])
    if fits[best] > 0:
        board.place(number, best)
