"""Holds and routes as tables: CSV and GeoJSON."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from walltopo.core.files import atomic_path, write_json
from walltopo.publish.atlas.visible_faces import front_direction
from walltopo.publish.wall_data import Wall
from walltopo.scans.routes import Route, route_name

COLUMNS = ("id", "class", "type", "colour", "route", "score", "size_m", "area_m2", "steepness_deg")
ROUTE_FIGURES = ("length_m", "largest_move_m", "steepness_deg")
ROUTE_HOLDS = ("start", "top", "zone", "footholds", "holds")
ROUTE_SAID = ("grade", "setter", "date", "description")
ROUTE_DOUBTS = ("doubtful_start", "doubtful_top")


def routes_beside(path: Path) -> Path:
    """Where `write_csv` puts the routes: `wall.routes.csv` beside `wall.csv`."""
    return path.with_name(f"{path.stem}.routes{path.suffix}")


def write_csv(path: Path, wall: Wall) -> None:
    """One line a hold, position as x, y, z in metres; and beside it one line a route."""
    names = {route.id: route_name(route) for route in wall.routes}
    parts = _parts(wall.routes)
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


def _parts(routes: Sequence[Route]) -> dict[int, str]:
    """What holds are in their routes: start, top, zone, foot; of several with spaces between."""
    found: dict[int, list[str]] = {}
    for route in routes:
        lists = {"start": route.start, "top": route.top, "zone": route.zone}
        for part, holds in (lists | {"foot": route.footholds}).items():
            for hold in holds:
                if part not in found.setdefault(hold, []):
                    found[hold].append(part)
    return {hold: " ".join(parts) for hold, parts in found.items()}


def _route_table(wall: Wall) -> tuple[list[str], list[list[Any]]]:
    """Head and lines; lists of holds are their ids, from bottom to top, with spaces between."""
    rows = []
    for route in wall.routes:
        plain = msgspec.to_builtins(route)
        lists = [" ".join(map(str, plain[key])) for key in ROUTE_HOLDS]
        figures = [plain[key] for key in ROUTE_FIGURES]
        said, doubts = ([plain[key] for key in keys] for keys in (ROUTE_SAID, ROUTE_DOUBTS))
        known = [route.id, route_name(route), route.colour, *said, len(route.holds)]
        rows.append([*known, *figures, *lists, *doubts])
    head = ["id", "name", "colour", *ROUTE_SAID, "hold_count", *ROUTE_FIGURES]
    return [*head, *ROUTE_HOLDS, *ROUTE_DOUBTS], rows


def _write_rows(path: Path, head: list[str], rows: list[list[Any]]) -> None:
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(head)
        writer.writerows([_cell(value) for value in row] for row in rows)


def _cell(value: Any) -> Any:
    """A cell that no spreadsheet takes for a formula."""
    if isinstance(value, str) and value[:1] in ("=", "+", "-", "@"):
        return "'" + value
    return "" if value is None else value


def write_geojson(path: Path, wall: Wall) -> None:
    """Holds as points and routes as lines in the wall's own flat map.

    The coordinates are metres along the wall (as seen from the front) and height, not degrees:
    the collection says so in `walltopo`. The place in space is each feature's `position`.
    """
    front = front_direction(wall.mesh)
    right = np.cross(-front, np.array([0.0, 0.0, 1.0]))

    def flat(position: Sequence[float]) -> list[float]:
        along = float(np.dot(position, right))
        return [round(along, 4), round(float(position[2]), 4)]

    keys = (*COLUMNS, "position", "normal")
    features: list[dict[str, Any]] = [
        {
            "type": "Feature",
            "id": f"hold-{hold.id}",
            "geometry": {"type": "Point", "coordinates": flat(hold.position)},
            "properties": {key: msgspec.to_builtins(hold)[key] for key in keys},
        }
        for hold in wall.holds
    ]
    places = {hold.id: hold.position for hold in wall.holds}
    for route in wall.routes:
        line = [flat(places[hold]) for hold in route.holds if hold in places]
        kind = "LineString" if len(line) > 1 else "MultiPoint"
        properties = msgspec.to_builtins(route)
        del properties["ambiguous"]
        features.append(
            {
                "type": "Feature",
                "id": f"route-{route.id}",
                "geometry": {"type": kind, "coordinates": line},
                "properties": properties,
            }
        )
    unit = "metres" if wall.metric else "arbitrary units"
    note = {"coordinates": f"{unit}: along the wall, height", "along": right.tolist()}
    write_json(path, {"type": "FeatureCollection", "walltopo": note, "features": features})
