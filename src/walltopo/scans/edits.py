"""A setter's corrections: `holds.edits.json` and `routes.edits.toml`.

Ids may change from scan to scan, places hardly do: so every hold is given by its id and its
position (`at`, metres, world frame), and every route by its id and the position of one of its
holds. Whoever applies an edit looks for the place first and falls back to the id.

`holds.edits.json`::

    {"version": 1,
     "holds": [{"id": 7, "at": [x, y, z], "colour": "red", "type": "jug", "deleted": true}],
     "strokes": [{"hold": 7, "at": [x, y, z], "radius_m": 0.03}]}

A hold entry has any of `colour`, `type`, `class`, `deleted`, and `kept` (a doubtful instance is a
hold after all). A stroke is a ball: the triangles
whose centroid lies in it go to the hold (0: to the wall), in the order of the list.

`routes.edits.toml`, applied from top to bottom within each kind, in this order of kinds::

    version = 1
    [[merge]]                      # both become one route, under the first one's id
    routes = [3, 5]
    at = [[x, y, z], [x, y, z]]    # a hold of each
    [[split]]                      # these holds leave their route and make one of their own
    route = 3
    holds = [12, 14]
    at = [[x, y, z], [x, y, z]]    # of the holds
    [[assign]]                     # this hold belongs to that route; route 0: to none
    hold = 12
    at = [x, y, z]
    route = 4
    route_at = [x, y, z]           # a hold of the route
    [[rename]]
    route = 4
    at = [x, y, z]                 # a hold of the route
    name = "The Owl"
    [[colour]]
    route = 4
    at = [x, y, z]
    colour = "red"
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.scans.folder import atomic_path, read_json, write_json

__all__ = [
    "apply_strokes",
    "check_hold_edits",
    "check_route_edits",
    "read_hold_edits",
    "read_route_edits",
    "write_hold_edits",
    "write_route_edits",
]

Check = Callable[[Any], bool]


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _place(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(_number(v) for v in value)


def _list_of(check: Check) -> Check:
    return lambda value: isinstance(value, list) and all(check(v) for v in value)


def _text(value: Any) -> bool:
    return isinstance(value, str) and len(value) <= 200


# Per kind of entry: the keys it must have, then those it may have.
_HOLDS: dict[str, tuple[dict[str, Check], dict[str, Check]]] = {
    "holds": (
        {"id": _whole, "at": _place},
        {
            "colour": _text,
            "type": _text,
            "class": lambda value: value in ("hold", "volume"),
            "deleted": lambda value: isinstance(value, bool),
            "kept": lambda value: isinstance(value, bool),
        },
    ),
    "strokes": (
        {"hold": _whole, "at": _place, "radius_m": lambda v: _number(v) and 0 < v < 10},
        {},
    ),
}
_ROUTES: dict[str, tuple[dict[str, Check], dict[str, Check]]] = {
    "merge": ({"routes": _list_of(_whole), "at": _list_of(_place)}, {}),
    "split": ({"route": _whole, "holds": _list_of(_whole), "at": _list_of(_place)}, {}),
    "assign": ({"hold": _whole, "at": _place, "route": _whole}, {"route_at": _place}),
    "rename": ({"route": _whole, "at": _place, "name": _text}, {}),
    "colour": ({"route": _whole, "at": _place, "colour": _text}, {}),
}


def _checked(
    value: Any, kinds: Mapping[str, tuple[dict[str, Check], dict[str, Check]]], where: str
) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{where}: expected a table of edits")
    if value.get("version", 1) != 1:
        raise InputError(f"{where}: version {value['version']} is not known, expected 1")
    stray = sorted(set(value) - set(kinds) - {"version"})
    if stray:
        raise InputError(f"{where}: unknown {', '.join(stray)}; expected {', '.join(kinds)}")
    result: dict[str, Any] = {"version": 1}
    for kind, (needed, optional) in kinds.items():
        entries = value.get(kind, [])
        if not isinstance(entries, list):
            raise InputError(f"{where}: {kind} must be a list")
        for number, entry in enumerate(entries, start=1):
            _check_entry(entry, needed, optional, f"{where}: {kind} {number}")
        result[kind] = entries
    return result


def _check_entry(
    entry: Any, needed: dict[str, Check], optional: dict[str, Check], where: str
) -> None:
    if not isinstance(entry, dict):
        raise InputError(f"{where}: expected a table")
    missing = sorted(set(needed) - set(entry))
    stray = sorted(set(entry) - set(needed) - set(optional))
    if missing or stray:
        raise InputError(
            f"{where}: missing {', '.join(missing) or 'nothing'}, "
            f"unknown {', '.join(stray) or 'nothing'}"
        )
    for key, check in (needed | optional).items():
        if key in entry and not check(entry[key]):
            raise InputError(f"{where}: {key} cannot be {entry[key]!r}")


def check_hold_edits(value: Any, where: str) -> dict[str, Any]:
    """The edits with every list present, or an InputError that names `where` and the entry."""
    return _checked(value, _HOLDS, where)


def check_route_edits(value: Any, where: str) -> dict[str, Any]:
    """The edits with every list present, or an InputError that names `where` and the entry."""
    return _checked(value, _ROUTES, where)


def read_hold_edits(path: Path) -> dict[str, Any]:
    """`holds.edits.json` with every list present; empty lists where the file is absent."""
    return check_hold_edits(read_json(path) if path.is_file() else {}, str(path))


def read_route_edits(path: Path) -> dict[str, Any]:
    """`routes.edits.toml` with every list present; empty lists where the file is absent."""
    if not path.is_file():
        return check_route_edits({}, str(path))
    try:
        value = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML ({error})") from error
    return check_route_edits(value, str(path))


def write_hold_edits(path: Path, edits: Mapping[str, Any]) -> None:
    """Check and write, atomically."""
    write_json(path, check_hold_edits(dict(edits), str(path)))


def write_route_edits(path: Path, edits: Mapping[str, Any]) -> None:
    """Check and write, atomically."""
    checked = check_route_edits(dict(edits), str(path))
    lines = ["# Corrections of routes; applied on every run of the scan.", "version = 1"]
    for kind in _ROUTES:
        for entry in checked[kind]:
            lines += ["", f"[[{kind}]]"]
            # JSON's strings, numbers and lists are TOML's too.
            lines += [
                f"{key} = {json.dumps(v, ensure_ascii=False)}".replace("\x7f", "\\u007f")
                for key, v in entry.items()
            ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def apply_strokes(
    mesh: Mesh, face_instance: NDArray[np.int32], strokes: list[dict[str, Any]]
) -> NDArray[np.int32]:
    """Labels after painting, in the order of the strokes; the input stays as it is.

    Parameters
    ----------
    face_instance : (F,) int32, 0 = wall.
    strokes : entries `{"hold", "at", "radius_m"}`.
    """
    labels = face_instance.copy()
    if not strokes:
        return labels
    from scipy.spatial import cKDTree

    tree = cKDTree(mesh.centroids)
    for stroke in strokes:
        labels[tree.query_ball_point(stroke["at"], stroke["radius_m"])] = stroke["hold"]
    return labels
