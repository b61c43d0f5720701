"""Climbs of the routes of a generated gym, with the exact contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import read_json
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.beta.in_view import WallHolds
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.on_wall import climb_of, on_route
from walltopo_climb.movement.sequence import find_sequence
from walltopo_lab.evaluate.truth import Truth, read_truth
from walltopo_lab.synth.performance import Performance, TrueContact, perform

Floats = NDArray[np.float64]

_SAMPLES: Final = 48  # points of a hold's surface
_FEW_MOVES: Final = 3
_TOP_S: Final = 0.5  # both hands hold the top so long


@dataclass(frozen=True, eq=False)
class TrueWall:
    """The holds and routes of a generated gym as a scan without errors has them, metres."""

    holds: tuple[Hold, ...]
    routes: tuple[Route, ...]
    surfaces: WallHolds


@dataclass(frozen=True, eq=False)
class TrueClimb:
    """A climb of a route.

    Parameters
    ----------
    outward : (3,) the mean direction out of the wall.
    contacts : by hold id, in order of their begin.
    is_topped : whether both hands hold the top.
    """

    performance: Performance
    outward: Floats
    contacts: tuple[TrueContact, ...]
    is_topped: bool


def read_true_wall(folder: Path) -> TrueWall:
    """Return the wall of a folder of `walltopo synth`.

    Raises
    ------
    InputError : the folder is not a generated gym.
    """
    truth = read_truth(folder)
    rows = list(read_json(folder / "truth" / "scene.json")["instances"])
    surfaces = {int(row["id"]): _surface(truth, int(row["id"])) for row in rows}
    holds = tuple(_hold(row, surfaces[int(row["id"])]) for row in rows)
    routes = tuple(
        _route(number, [row for row in rows if row["route"] == number])
        for number in sorted({row["route"] for row in rows if row["route"] >= 0})
    )
    volumes = np.array([hold.role == "volume" for hold in holds])
    sampled = np.array([surfaces[hold.id] for hold in holds])
    ids = np.array([hold.id for hold in holds])
    return TrueWall(holds, routes, WallHolds(ids, sampled, volumes))


def climb_route(
    wall: TrueWall, route: Route, body: Body, rng: np.random.Generator, *, falls: bool
) -> TrueClimb | None:
    """Return a climb of a route as the movement model climbs it, None with less than three moves.

    Parameters
    ----------
    falls : whether the climb ends in a fall after three moves or more.
    """
    used = on_route(route, wall.holds, 1.0)
    climb = climb_of(route, used, 1.0)
    sequence = None if climb is None else find_sequence(climb, body)
    if climb is None or sequence is None or len(sequence.moves) < _FEW_MOVES:
        return None
    if falls:
        length = int(rng.integers(_FEW_MOVES, len(sequence.moves) + 1))
        sequence = replace(sequence, moves=sequence.moves[:length], reached=False)
    performance = perform(climb, sequence, rng)
    contacts = tuple(replace(one, hold=used[one.hold].id) for one in performance.contacts)
    outward = climb.grips.wall.mean(axis=0)
    return TrueClimb(performance, outward, contacts, _is_topped(contacts, route))


def _surface(truth: Truth, instance: int) -> Floats:
    faces = truth.mesh.faces[truth.face_instance == instance]
    centres = truth.mesh.vertices[faces].mean(axis=1)
    return centres[np.linspace(0, len(centres) - 1, _SAMPLES).astype(int)]


def _hold(row: dict[str, Any], surface: Floats) -> Hold:
    normal = np.array(row["normal"])
    return Hold(
        id=int(row["id"]),
        kind=row["class"],
        type=row["kind"] if row["kind"] != "foot" else "foothold",
        colour=row["colour"],
        position=tuple(row["position"]),
        normal=tuple(row["normal"]),
        size=float(np.ptp(surface, axis=0).max()),
        steepness_deg=float(np.degrees(np.arcsin(np.clip(-normal[2], -1, 1)))),
        role="volume" if row["class"] == "volume" else "hold",
    )


def _route(number: int, rows: Sequence[dict[str, Any]]) -> Route:
    ids_of = {
        role: tuple(int(row["id"]) for row in rows if row["role"] == role)
        for role in ("start", "top", "foot")
    }
    return Route(
        id=number + 1,
        colour=rows[0]["colour"],
        holds=tuple(int(row["id"]) for row in rows),
        start=ids_of["start"],
        top=ids_of["top"],
        footholds=ids_of["foot"],
    )


def _is_topped(contacts: Sequence[TrueContact], route: Route) -> bool:
    left, right = (
        [one for one in contacts if one.limb == limb and one.hold in route.top] for limb in (0, 1)
    )
    return any(min(a.end, b.end) - max(a.begin, b.begin) >= _TOP_S for a in left for b in right)
