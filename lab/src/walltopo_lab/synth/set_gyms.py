"""Generated gyms, set but not photographed, for route clustering and its ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.scans.holds import Hold, Role
from walltopo_lab.evaluate.routes import type_of_kind
from walltopo_lab.synth.bodies import Body
from walltopo_lab.synth.holds import make_hold
from walltopo_lab.synth.params import gym_preset
from walltopo_lab.synth.setter import SetWall, set_downclimbs, set_routes
from walltopo_lab.synth.tnuts import sockets_of
from walltopo_lab.synth.volumes import place_volumes, volume_footprint
from walltopo_lab.synth.wall import build_wall

PRESETS = ("modern", "oldschool-dark", "lead", "modern", "easy")
# Predicted types of lifted holds, with counts: gyms 7000, modern and oldschool-dark.
CALLED = {
    "jug": {"jug": 57, "foothold": 2, "pinch": 1, "sloper": 1, "unknown": 15},
    "crimp": {"crimp": 13, "foothold": 5, "pocket": 1, "unknown": 12},
    "sloper": {"sloper": 29, "foothold": 2, "unknown": 3},
    "pinch": {"pinch": 30, "jug": 2, "foothold": 1, "unknown": 8},
    "pocket": {"pocket": 17, "foothold": 2, "sloper": 1, "unknown": 4},
    "foothold": {"foothold": 56, "pocket": 2, "unknown": 4},
}


@dataclass(frozen=True, eq=False)
class SetGym:
    """A wall with true holds, colours and routes.

    Parameters
    ----------
    route : hold id to its route, for holds on a route.
    part : hold id to its role in its route: hold, foot, start, top.
    body : hold id to its shape.
    """

    mesh: Mesh
    holds: list[Hold]
    route: dict[int, int]
    part: dict[int, str]
    body: dict[int, Body]


def _make_body(kind: str, style: str, rng: np.random.Generator, scale: float) -> Body:
    return make_hold(kind, style, rng, scale, 0.3)


def _one_surface(polygons: list[NDArray[np.float64]]) -> Mesh:
    """Return the facets as one connected mesh, in triangles of some decimetres."""
    import trimesh

    corners = np.vstack(polygons)
    faces, first = [], 0
    for polygon in polygons:
        faces += [[first, first + k, first + k + 1] for k in range(1, len(polygon) - 1)]
        first += len(polygon)
    joined = trimesh.Trimesh(corners, np.array(faces), process=True)
    for _ in range(4):
        joined = joined.subdivide()
    return Mesh(np.asarray(joined.vertices), np.asarray(joined.faces, dtype=np.int32))


def set_gym(preset: str, seed: int) -> SetGym:
    """Return the wall of `walltopo synth --preset PRESET --seed SEED` with its routes."""
    settings, _ = gym_preset(preset)
    wall = build_wall(settings, np.random.default_rng([seed, 1]))
    facets, volumes = place_volumes(wall, settings, np.random.default_rng([seed, 2]))
    hosts = [*wall, *facets]
    board = SetWall(sockets_of(hosts), hosts, len(volumes) + 1)
    board.blocked += [(v.position, 0.8 * volume_footprint(v, facets), v.id) for v in volumes]
    x = board.sockets.points[:, 0]
    low, width = float(x.min()), float(np.ptp(x)) / settings.routes
    slack = 0.1 * width
    lanes = [
        (low + k * width - slack, low + (k + 1) * width + slack) for k in range(settings.routes)
    ]
    set_downclimbs(board, settings, _make_body, np.random.default_rng([seed, 4]))
    set_routes(board, lanes, 0, settings, _make_body, np.random.default_rng([seed, 3]))
    mesh = _one_surface([facet.corners for facet in wall])
    holds, route, part, body = [], {}, {}, {}
    for item in board.holds:
        rgb = (255 * np.array(item.rgb)).round().astype(int).tolist()
        position, normal = item.position.tolist(), item.normal.tolist()
        assert item.body is not None
        body[item.id] = item.body
        role: Role = "downclimb" if item.route == -2 else "hold"
        holds.append(
            Hold(
                item.id,
                "hold",
                position=(position[0], position[1], position[2]),
                normal=(normal[0], normal[1], normal[2]),
                type=type_of_kind(item.kind),
                colour=item.colour,
                colour_rgb=(rgb[0], rgb[1], rgb[2]),
                size=2 * item.body.radius,
                role=role,
            )
        )
        if role == "hold":
            route[item.id], part[item.id] = item.route, item.role
    return SetGym(mesh, holds, route, part, body)
