"""A simulated setter: each route gets a colour, a family of holds, starts, moves and a top."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Body, Facet, GymInstance, Placement
from walltopo_lab.synth.holds import STYLES
from walltopo_lab.synth.palette import DOWNCLIMB_GREY, PALETTES
from walltopo_lab.synth.params import GymSettings
from walltopo_lab.synth.tnuts import Sockets

Floats = NDArray[np.float64]
MakeHold = Callable[[str, str, np.random.Generator, float], Body]

# Probabilities of (jug, crimp, sloper, pinch, pocket) by the steepness of the wall.
_ODDS = {
    "slab": (0.10, 0.38, 0.30, 0.08, 0.14),
    "vertical": (0.20, 0.26, 0.20, 0.18, 0.16),
    "steep": (0.40, 0.12, 0.12, 0.22, 0.14),
}
_TURN_DEG = {"jug": 18, "crimp": 28, "sloper": 25, "pinch": 40, "pocket": 20, "foot": 60}


@dataclass(eq=False)
class SetWall:
    """The state of a wall during setting: sockets, holds and obstacles.

    Parameters
    ----------
    sockets : the T-nuts.
    facets : the facets with those T-nuts.
    holds : records of all holds so far.
    blocked : (centre (3,), radius, volume id) of obstacles other than holds.
    next_id : id of the next hold.
    """

    sockets: Sockets
    facets: Sequence[Facet]
    next_id: int
    holds: list[GymInstance] = field(default_factory=list)
    blocked: list[tuple[Floats, float, int]] = field(default_factory=list)

    def clearance(self) -> Floats:
        """Return (N,) metres from each T-nut to the nearest rim of any bolted object."""
        free = np.full(len(self.sockets.points), np.inf)
        owner = np.array([f.instance for f in self.facets])[self.sockets.facet]
        for centre, radius, volume in self.blocked:
            distance = np.linalg.norm(self.sockets.points - centre, axis=1) - radius
            free = np.where(owner == volume, free, np.minimum(free, distance))
        for hold in self.holds:
            assert hold.body is not None
            distance = np.linalg.norm(self.sockets.points - hold.position, axis=1)
            free = np.minimum(free, distance - hold.body.radius)
        return free

    def bolt(
        self,
        target: Floats,
        body: Body,
        rng: np.random.Generator,
        reach: float,
        **record: object,
    ) -> GymInstance | None:
        """Bolt a body to the free T-nut nearest to `target`; return None without one within
        `reach`.
        """
        gap = 0.012
        usable = self.clearance() > body.radius + gap
        usable &= self.sockets.margin > 0.7 * body.radius
        distance = np.linalg.norm(self.sockets.points - target, axis=1)
        distance = np.where(usable, distance, np.inf)
        best = int(distance.argmin())
        if distance[best] > reach:
            return None
        normal = self.sockets.normals[best]
        turn = np.radians(rng.normal(0, _TURN_DEG[str(record["kind"])]))
        u, v, n = self.facets[self.sockets.facet[best]].frame
        right = np.cos(turn) * u + np.sin(turn) * v
        rotation = np.stack([right, np.cross(n, right), n], axis=1)
        point = self.sockets.points[best]
        hold = GymInstance(
            id=self.next_id,
            label="hold",
            position=point,
            normal=normal,
            body=body,
            placement=Placement(rotation, point),
            **record,  # type: ignore[arg-type]
        )
        self.holds.append(hold)
        self.next_id += 1
        return hold


def _steepness(normal: Floats) -> str:
    lean = np.degrees(np.arcsin(np.clip(-normal[2], -1, 1)))
    return "slab" if lean < -3 else "vertical" if lean < 14 else "steep"


def _nearest(sockets: Sockets, target: Floats) -> int:
    return int(np.linalg.norm(sockets.points - target, axis=1).argmin())


@dataclass(frozen=True)
class _Route:
    number: int
    colour: str
    rgb: tuple[float, float, float]
    styles: tuple[str, ...]
    scale: float


def _set_one(
    wall: SetWall,
    route: _Route,
    lane: tuple[float, float],
    settings: GymSettings,
    make: MakeHold,
    rng: np.random.Generator,
) -> None:
    """Set one route from its start (about waist height) to the top."""
    sockets = wall.sockets
    count = int(rng.integers(settings.holds_low, settings.holds_high + 1))
    start_z, top_z = rng.uniform(0.8, 1.15), settings.height - rng.uniform(0.2, 0.45)
    heights = np.linspace(min(start_z, 0.4 * settings.height), top_z, count)
    low, high = lane
    x = rng.uniform(low + 0.25 * (high - low), high - 0.25 * (high - low))
    lean_side = rng.uniform(-0.35, 0.35) * (high - low)
    placed: list[GymInstance] = []
    for step, z in enumerate(heights):
        progress = step / max(1, count - 1)
        side = rng.uniform(0.14, 0.34) * (-1) ** step
        if settings.spray:
            aim_x, z = rng.uniform(low, high), rng.uniform(0.4, top_z)
        else:
            aim_x = float(np.clip(x + lean_side * progress + side, low, high))
        target = _on_wall(sockets, aim_x, float(z))
        normal = sockets.normals[_nearest(sockets, target)]
        odds = _ODDS[_steepness(normal)]
        kind = str(rng.choice(["jug", "crimp", "sloper", "pinch", "pocket"], p=odds))
        role = "start" if step < 2 else "top" if step == count - 1 else "hold"
        if role == "top" and rng.random() < 0.7:
            kind = "jug"
        style = route.styles[int(rng.integers(len(route.styles)))]
        body = make(kind, style, rng, settings.hold_scale * route.scale)
        hold = wall.bolt(
            target,
            body,
            rng,
            0.45,
            kind=kind,
            colour=route.colour,
            rgb=route.rgb,
            route=route.number,
            role=role,
        )
        if hold is not None:
            placed.append(hold)
    _add_footholds(wall, route, placed, settings, make, rng)


def _add_footholds(
    wall: SetWall,
    route: _Route,
    placed: Sequence[GymInstance],
    settings: GymSettings,
    make: MakeHold,
    rng: np.random.Generator,
) -> None:
    """Bolt the route's footholds below its holds."""
    for _ in range(round(len(placed) * settings.footholds)):
        above = placed[int(rng.integers(len(placed)))].position
        target = _on_wall(
            wall.sockets, above[0] + rng.uniform(-0.4, 0.4), above[2] - rng.uniform(0.35, 0.85)
        )
        body = make("foot", route.styles[0], rng, settings.hold_scale)
        if target[2] > 0.25:
            wall.bolt(
                target,
                body,
                rng,
                0.3,
                kind="foot",
                colour=route.colour,
                rgb=route.rgb,
                route=route.number,
                role="foot",
            )


def _on_wall(sockets: Sockets, x: float, z: float) -> Floats:
    """Return the T-nut nearest in x and z (the wall is nearly single-valued in them)."""
    away = np.hypot(sockets.points[:, 0] - x, sockets.points[:, 2] - z)
    return np.asarray(sockets.points[int(away.argmin())])


def set_routes(
    wall: SetWall,
    lanes: Sequence[tuple[float, float]],
    first_number: int,
    settings: GymSettings,
    make: MakeHold,
    rng: np.random.Generator,
) -> None:
    """Set one route in each lane (an interval of x, metres).

    Neighbouring lanes never share a colour; lanes two apart may, as in real gyms.
    """
    palette = list(PALETTES[settings.colours].items())
    recent: list[str] = []
    order: list[int] = []
    for offset, lane in enumerate(lanes):
        if not order:
            order = list(rng.permutation(len(palette)))
        fresh = [k for k in order if palette[k][0] not in recent[-2:]] or order
        pick = fresh[0]
        order.remove(pick)
        name, rgb = palette[pick]
        recent.append(name)
        shade = np.clip(np.array(rgb) * rng.uniform(0.92, 1.06) + rng.normal(0, 0.012, 3), 0.02, 1)
        odds = (0.27, 0.13, 0.18, 0.22, 0.07, 0.13)
        route = _Route(
            number=first_number + offset,
            colour=name,
            rgb=(float(shade[0]), float(shade[1]), float(shade[2])),
            styles=tuple(str(s) for s in rng.choice(STYLES, size=2, p=odds)),
            scale=float(rng.choice((0.85, 1.0, 1.15, 1.5), p=(0.25, 0.4, 0.2, 0.15))),
        )
        _set_one(wall, route, lane, settings, make, rng)


def set_downclimbs(
    wall: SetWall, settings: GymSettings, make: MakeHold, rng: np.random.Generator
) -> None:
    """Set big grey downclimb jugs that belong to no route."""
    points = wall.sockets.points
    for _ in range(settings.downclimb):
        x = rng.uniform(points[:, 0].min() + 0.3, points[:, 0].max() - 0.3)
        target = _on_wall(
            wall.sockets, x, rng.uniform(min(1.2, 0.4 * settings.height), settings.height - 0.4)
        )
        body = make("jug", "smooth", rng, settings.hold_scale * 1.15)
        wall.bolt(
            target,
            body,
            rng,
            0.6,
            kind="jug",
            colour="grey",
            rgb=DOWNCLIMB_GREY,
            route=-2,
            role="downclimb",
        )
