"""Write `moves.json` of a scan: the moves of each route by several bodies, and its grade range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from walltopo.scans.folder import ScanFolder, write_moves
from walltopo.scans.holds import Hold
from walltopo.scans.moves import GradeRow, Moves, RouteMoves, moves_basis
from walltopo.scans.routes import Route
from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.model import shipped_model
from walltopo_climb.grades.of_scan import grade_routes, rate_routes
from walltopo_climb.movement.body import BODIES, Body
from walltopo_climb.movement.rows import climber_rows
from walltopo_climb.wall_files import read_wall


def find_moves(
    holds: Sequence[Hold], routes: Sequence[Route], unit: float, bodies: Mapping[str, Body]
) -> Moves:
    """Return the moves and the grade range of each route.

    Parameters
    ----------
    holds : all holds of the wall. unit : scan units per metre.
    bodies : climbers by name.
    """
    model = shipped_model()
    ranges = grade_routes(rate_routes(routes, holds, unit, model), model)
    rows = []
    for route in routes:
        found = ranges.get(route.id)
        grade = None
        if found is not None:
            grade = GradeRow(FONT[found.low], FONT[found.high], found.coverage, found.graded)
        rows.append(RouteMoves(route.id, climber_rows(route, holds, unit, bodies), grade))
    return Moves(unit=unit, made_for=moves_basis(holds, routes), routes=tuple(rows))


def renew_moves(folder: ScanFolder) -> None:
    """Write the moves of a scan anew, of the same bodies, if its holds or routes changed.

    Raises
    ------
    InputError : `moves.json`, the holds or the routes are missing or damaged.
    """
    old = Moves.load(folder.moves)
    holds, routes, unit = read_wall(folder.root)
    if old.made_for != moves_basis(holds, routes):
        write_moves(folder, find_moves(holds, routes, unit, _bodies_of(old)))


def _bodies_of(moves: Moves) -> dict[str, Body]:
    """Return the standard bodies, and those that somebody added when the moves were found."""
    rows = [row for route in moves.routes for row in route.climbers]
    return BODIES | {row.climber: Body(row.height, row.span) for row in rows}
