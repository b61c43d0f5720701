"""`walltopo moves` and `walltopo grade`: likely moves and grade ranges of routes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walltopo.cli.options import Number

if TYPE_CHECKING:
    from walltopo.scans.moves import ClimberRow


_MOVES = """examples:
  walltopo moves gym3                     a child, a short, a usual and a tall adult
  walltopo moves gym3 --height 1.68       and you
"""
_GRADE = """examples:
  walltopo grade gym3
  walltopo grade gym3 --format json
"""

Commands = argparse._SubParsersAction  # argparse has no public name for it


def register_moves(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add `walltopo moves`."""
    moves = commands.add_parser(
        "moves",
        help="how each route may be climbed, by bodies of several heights",
        description="Find likely moves up each route of a scan, and the moves that a short person "
        "cannot reach. Writes moves.json (and moves.js, for a page opened from disk) into the "
        "scan; its page then shows them. Later runs and edits renew them.",
        epilog=_MOVES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    moves.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    moves.add_argument(
        "--height", type=Number(float, 0.9, 2.3), metavar="M", help="also for a body this tall [m]"
    )
    moves.add_argument(
        "--reach", type=Number(float, 0.7, 2.8), metavar="M", help="arm span of that body [m]"
    )
    moves.set_defaults(run=_moves)


def register_grade(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add `walltopo grade`."""
    grade = commands.add_parser(
        "grade",
        help="a range of grades for each route, from its geometry",
        description="Estimate how hard each route of a scan is, as a range on the Font scale. "
        "Grades that setters gave (in the editor) calibrate the estimate to the gym's own scale.",
        epilog=_GRADE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    grade.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    grade.add_argument("--format", choices=("table", "json"), default="table")
    grade.set_defaults(run=_grade)


def _moves(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core import SettingsError
    from walltopo.pipeline.runner import refresh
    from walltopo.pipeline.workplace import locked
    from walltopo.scans.folder import ScanFolder, write_moves
    from walltopo.scans.routes import route_name
    from walltopo_climb.movement.body import BODIES, Body
    from walltopo_climb.moves_file import find_moves
    from walltopo_climb.wall_files import read_wall

    if args.reach is not None and args.height is None:
        raise SettingsError("--reach needs --height")
    bodies = dict(BODIES)
    if args.height is not None:
        bodies["you"] = Body(args.height, args.reach or 0.0)
    folder = ScanFolder(args.scan)
    holds, routes, unit = read_wall(args.scan)
    moves = find_moves(holds, routes, unit, bodies)
    for route, row in zip(routes, moves.routes, strict=True):
        console.print(f"{route_name(route)}: {climbers_summary(row.climbers)}", soft_wrap=True)
    with locked(folder):
        write_moves(folder, moves)
        if folder.page.exists():
            refresh(folder, ["export"])  # the page loads moves.json only if it names the file
    return 0


def climbers_summary(climbers: tuple[ClimberRow, ...]) -> str:
    """Return one line on how each body climbs a route."""
    if not climbers:
        return "no moves: the route has no start or no top"
    words = []
    for row in climbers:
        leap = max((move.beyond for move in row.moves), default=0.0)
        if not row.moves:
            words.append(f"{row.climber} cannot reach the start")
        elif not row.reached:
            words.append(f"{row.climber} does not reach the top")
        elif leap > 0:
            words.append(f"{row.climber} must leap ({leap:.2f} m beyond reach)")
        else:
            words.append(f"{row.climber} reaches every hold")
    return "; ".join(words)


def _grade(args: argparse.Namespace) -> int:
    import json

    from walltopo.cli.console import console
    from walltopo.scans.routes import route_name
    from walltopo_climb.grades.font import FONT
    from walltopo_climb.grades.model import shipped_model
    from walltopo_climb.grades.of_scan import grade_routes, rate_routes
    from walltopo_climb.wall_files import read_wall

    holds, routes, unit = read_wall(args.scan)
    model = shipped_model()
    ranges = grade_routes(rate_routes(routes, holds, unit, model), model)
    rows: list[dict[str, Any]] = []
    for route in routes:
        found = ranges.get(route.id)
        low, high = ("", "") if found is None else (FONT[found.low], FONT[found.high])
        rows.append(
            {
                "route": route.id,
                "name": route_name(route),
                "grade": route.grade,
                "low": low,
                "high": high,
                "coverage": None if found is None else found.coverage,
                "graded": None if found is None else found.graded,
            }
        )
    if args.format == "json":
        text = json.dumps({"version": 1, "routes": rows}, indent=1)
        console.out(text, highlight=False)
    else:
        console.print(_grade_table(rows))
    return 0


def _grade_table(rows: list[dict[str, Any]]) -> Any:
    from rich.table import Table

    table = Table()
    for name in ("route", "name", "its grade", "range", "based on"):
        table.add_column(name)
    for row in rows:
        span = f"{row['low']} to {row['high']}" if row["low"] else "no sequence found"
        basis = f"{row['graded']} grades of this wall" if row["graded"] else "board grades only"
        table.add_row(str(row["route"]), row["name"], row["grade"], span, basis)
    return table
