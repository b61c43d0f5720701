"""Hold and route tables as `EXT_structural_metadata` property tables.

Format: Cesium's "EXT_structural_metadata" and "EXT_mesh_features" (3D Tiles Next extensions of
glTF 2.0). Row k of the hold table describes feature id k; row 0 is the wall itself, and an id
without a hold (removed by an edit) keeps an empty row, so that ids stay those of `holds.json`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from walltopo.core.mesh import triangle_areas
from walltopo.publish.surface import Surface
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route

NO_NUMBER = -9999.0
NO_ROUTE = -1


@dataclass(frozen=True)
class Column:
    """One property: its name, schema entry and values by row."""

    name: str
    schema: dict[str, Any]
    values: Sequence[Any]


def _text(description: str) -> dict[str, Any]:
    return {"type": "STRING", "description": description}


def _number(description: str, component: str = "FLOAT32", **more: Any) -> dict[str, Any]:
    return {
        "type": "SCALAR",
        "componentType": component,
        "description": description,
        **more,
    }


def _holds(description: str) -> dict[str, Any]:
    return {**_number(description, "UINT32"), "array": True}


_VECTOR = {"type": "VEC3", "componentType": "FLOAT32"}

HOLD_SCHEMA: dict[str, dict[str, Any]] = {
    "class": _text("wall, hold, volume; none where an id is not in use"),
    "type": _text("jug, crimp, sloper, pinch, pocket, foot, ..."),
    "colour": _text("name of the colour"),
    "second_colour": _text("name of the smaller part's colour; empty: the hold has one colour"),
    "route": _number("id of the hold's route", "INT32", noData=NO_ROUTE, default=NO_ROUTE),
    "score": _number("confidence from 0 to 1"),
    "position": {**_VECTOR, "description": "centre, metres, z up (the mesh's own frame)"},
    "normal": {**_VECTOR, "description": "outward unit normal, the mesh's own frame"},
    "size_m": _number("longest extent, metres", noData=NO_NUMBER),
    "area_m2": _number("surface, square metres", noData=NO_NUMBER),
    "steepness_deg": _number("0 vertical, positive overhanging", noData=NO_NUMBER),
}

ORIGIN_SCHEMA: dict[str, dict[str, Any]] = {
    "origin": _text("measured, or guessed: spans a hole that no photo measured"),
    "area_m2": _number("surface, square metres"),
}

ROUTE_SCHEMA: dict[str, dict[str, Any]] = {
    "id": _number("route id", "INT32"),
    "name": _text("given by a setter"),
    "colour": _text("name of the colour"),
    "grade": _text("given by a setter"),
    "setter": _text("who set it"),
    "date": _text("when it was set, ISO"),
    "description": _text("given by a setter"),
    "holds": _holds("hold ids from bottom to top"),
    "start": _holds("ids of the start holds"),
    "top": _holds("ids of the top"),
    "zone": _holds("ids of the zone"),
    "footholds": _holds("ids of the holds for feet alone"),
    "length_m": _number("length along the wall, metres", noData=NO_NUMBER),
    "steepness_deg": _number("mean; 0 vertical, positive overhanging", noData=NO_NUMBER),
}

SCHEMA: dict[str, Any] = {
    "id": "walltopo_1",
    "name": "walltopo",
    "classes": {
        "hold": {"name": "Hold", "properties": HOLD_SCHEMA},
        "route": {"name": "Route", "properties": ROUTE_SCHEMA},
        "origin": {"name": "Origin", "properties": ORIGIN_SCHEMA},
    },
}


def _cell_value(entry: dict[str, Any], value: Any) -> Any:
    """Return a cell by its schema; an empty one is "", [], zeros or the `noData` value."""
    if entry["type"] == "STRING":
        return "" if value is None else str(value)
    if entry["type"] == "VEC3":
        return [0.0, 0.0, 0.0] if value is None else value
    if entry.get("array"):
        return value or []
    return entry.get("noData", 0) if value is None or not np.isfinite(value) else value


def _columns(schema: dict[str, Any], rows: Sequence[dict[str, Any]]) -> list[Column]:
    return [
        Column(name, entry, [_cell_value(entry, row.get(name)) for row in rows])
        for name, entry in schema.items()
    ]


def hold_columns(holds: Sequence[Hold], max_id: int = 0) -> list[Column]:
    """Return the columns of the hold table; row k is feature id k, row 0 the wall.

    Parameters
    ----------
    holds : rows of `holds.json`.
    max_id : the highest feature id in the mesh (the table covers it even without a hold row).
    """
    count = max([max_id, *(hold.id for hold in holds)]) + 1
    rows: list[dict[str, Any]] = [{"class": "none"} for _ in range(count)]
    rows[0] = {"class": "wall"}
    for hold in holds:
        rows[hold.id] = msgspec.to_builtins(hold)
    return _columns(HOLD_SCHEMA, rows)


def origin_columns(surface: Surface) -> list[Column]:
    """Return the columns of the table of origins: row 0 is measured, row 1 guessed surface.

    Parameters
    ----------
    surface : a surface with `guessed`.
    """
    assert surface.guessed is not None
    of_face = surface.guessed[surface.triangles[:, 0]]
    each = triangle_areas(surface.positions, surface.triangles)
    areas = np.bincount(of_face, each, minlength=2)
    rows = [
        {"origin": "measured", "area_m2": float(areas[0])},
        {"origin": "guessed", "area_m2": float(areas[1])},
    ]
    return _columns(ORIGIN_SCHEMA, rows)


def route_columns(routes: Sequence[Route]) -> list[Column]:
    """Return the columns of the route table, one row per route."""
    return _columns(ROUTE_SCHEMA, [msgspec.to_builtins(route) for route in routes])
