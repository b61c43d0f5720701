"""Write holds and routes as CSV tables."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core.files import atomic_path
from walltopo.publish.wall_data import WallModel
from walltopo.scans.routes import Route, route_name

COLUMNS = (
    "id",
    "class",
    "type",
    "colour",
    "second_colour",
    "route",
    "score",
    "size_m",
    "area_m2",
    "steepness_deg",
)
ROUTE_FIGURES = ("length_m", "largest_move_m", "steepness_deg")
ROUTE_HOLDS = ("start", "top", "zone", "footholds", "holds")
ROUTE_FACTS = ("grade", "setter", "date", "description")
ROUTE_DOUBTS = ("doubtful_start", "doubtful_top")


def routes_beside(path: Path) -> Path:
    """Return the path of the route table of `write_csv`: `wall.routes.csv` beside `wall.csv`."""
    return path.with_name(f"{path.stem}.routes{path.suffix}")


def write_csv(path: Path, wall: WallModel) -> None:
    """Write one line per hold, position as x, y, z in metres; and beside it one line per route."""
    names = {route.id: route_name(route) for route in wall.routes}
    parts = _roles_in_routes(wall.routes)
    rows = []
    for hold in wall.holds:
        plain = msgspec.to_builtins(hold)
        route = names.get(hold.route, "") if hold.route is not None else ""
        row = [plain[key] for key in COLUMNS]
        rows.append([*row, *hold.position, len(hold.photos), route])
        rows[-1] += [parts.get(hold.id, ""), hold.role, hold.review]
    head = [*COLUMNS, "x", "y", "z", "photos", "route_name", "part", "role", "review"]
    _write_rows(path, head, rows)
    _write_rows(routes_beside(path), *_route_table(wall))


def _roles_in_routes(routes: Sequence[Route]) -> dict[int, str]:
    """Return the roles of holds in their routes (start, top, zone, foot), separated by spaces."""
    found: dict[int, list[str]] = {}
    for route in routes:
        lists = {"start": route.start, "top": route.top, "zone": route.zone}
        for part, holds in (lists | {"foot": route.footholds}).items():
            for hold in holds:
                if part not in found.setdefault(hold, []):
                    found[hold].append(part)
    return {hold: " ".join(parts) for hold, parts in found.items()}


def _route_table(wall: WallModel) -> tuple[list[str], list[list[Any]]]:
    """Return head and lines; a list of holds is its ids from bottom to top, separated by spaces."""
    rows = []
    for route in wall.routes:
        plain = msgspec.to_builtins(route)
        lists = [" ".join(map(str, plain[key])) for key in ROUTE_HOLDS]
        figures = [plain[key] for key in ROUTE_FIGURES]
        by_setter, doubts = ([plain[key] for key in keys] for keys in (ROUTE_FACTS, ROUTE_DOUBTS))
        known = [route.id, route_name(route), route.colour, *by_setter, len(route.holds)]
        rows.append([*known, *figures, *lists, *doubts])
    head = ["id", "name", "colour", *ROUTE_FACTS, "hold_count", *ROUTE_FIGURES]
    return [*head, *ROUTE_HOLDS, *ROUTE_DOUBTS], rows


def _write_rows(path: Path, head: list[str], rows: list[list[Any]]) -> None:
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(head)
        writer.writerows([_safe_cell(value) for value in row] for row in rows)


def _safe_cell(value: Any) -> Any:
    """Return a cell that no spreadsheet interprets as a formula."""
    if isinstance(value, str) and value[:1] in ("=", "+", "-", "@"):
        return "'" + value
    return "" if value is None else value
