"""The data types of a generated gym: bodies, facets, instances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Body:
    """A closed organic body in its own frame: x right, y up the wall, z out of the wall.

    Parameters
    ----------
    vertices : (V, 3) float64, metres; the wall's surface is z = 0.
    faces : (F, 3) int32, counter-clockwise from outside.
    normals : (V, 3) float64, unit.
    chalk : (V,) float32 in [0, 1], how much hands rub that place.
    gloss : (V,) float32 in [0, 1], 1 = the slick part of a dual texture.
    steel : (V,) float32 in [0, 1], 1 = the bolt.
    radius : half of the largest extent in the wall's plane, metres.
    """

    vertices: Floats
    faces: NDArray[np.int32]
    normals: Floats
    chalk: NDArray[np.float32]
    gloss: NDArray[np.float32]
    steel: NDArray[np.float32]
    radius: float


PRINTS = ("plate", "sticker")  # kinds of facets whose axes follow their edges


@dataclass(frozen=True, eq=False)
class Facet:
    """A painted plane polygon: a piece of wall, volume, floor or building.

    Parameters
    ----------
    corners : (3 or 4, 3) float64 world, counter-clockwise seen from outside.
    kind : selects the painter: wall, fin, volume, dome (a patch of a round volume), floor, plate,
        sticker, concrete, ceiling.
    instance : id of the facet's volume, 0 = none.
    texel : size of a texel, metres.
    style : number with a painter-specific meaning (colour, plate or sticker number).
    """

    corners: Floats
    kind: str
    instance: int = 0
    texel: float = 0.003
    style: int = 0

    @cached_property
    def frame(self) -> tuple[Floats, Floats, Floats]:
        """Return unit u (level, to the right seen from outside), v (up the facet), n (outward)."""
        a, b, c = self.corners[:3]
        normal = np.cross(b - a, c - a)
        if self.kind in PRINTS:  # align the axes with the print, which follows the plate's edges
            u, n = (b - a) / np.linalg.norm(b - a), normal / np.linalg.norm(normal)
            return u, np.cross(n, u), n
        return frame_of(normal)

    def chart(self, points: Floats) -> Floats:
        """Return (..., 2) chart coordinates of world points (..., 3): metres from corner 0."""
        u, v, _ = self.frame
        relative = points - self.corners[0]
        return np.stack([relative @ u, relative @ v], axis=-1)

    def inside(self, point: Floats) -> float:
        """Return the distance from a point in the plane to the nearest edge; m, < 0 outside."""
        uv = self.chart(self.corners)
        p = self.chart(point)
        edges = np.roll(uv, -1, axis=0) - uv
        lengths = np.linalg.norm(edges, axis=1)
        to_point = p - uv
        cross = edges[:, 0] * to_point[:, 1] - edges[:, 1] * to_point[:, 0]
        return float((cross / lengths).min())

    def carries(self, point: Floats) -> bool:
        """Return whether a point lies on the facet (within 5 cm of its plane)."""
        return abs((point - self.corners[0]) @ self.frame[2]) < 0.05 and self.inside(point) > 0


def frame_of(normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a right-handed unit frame (u, v, n) with u level; for a level plane u = x."""
    n = normal / np.linalg.norm(normal)
    u = np.cross([0.0, 0.0, 1.0], n)
    length = np.linalg.norm(u)
    u = u / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    return u, np.cross(n, u), n


@dataclass(frozen=True, eq=False)
class Placement:
    """The pose of a bolted body: world_from_body rotation (3, 3) and origin (3,), metres."""

    rotation: Floats
    origin: Floats


@dataclass(frozen=True)
class SecondColour:
    """The second colour of a hold and the part that has it.

    Parameters
    ----------
    name : name of the colour; rgb : (3,) albedo in sRGB, 0..1.
    plane : x, y, z of a unit vector and a distance: the part of the body beyond this plane; None:
        the slick part.
    share : of the body's area, without its back on the wall.
    """

    name: str
    rgb: tuple[float, float, float]
    plane: tuple[float, float, float, float] | None
    share: float


@dataclass(frozen=True, eq=False)
class GymInstance:
    """One instance of the truth, as in `scene.json`.

    Parameters
    ----------
    id : >= 1, the value in `face_instance`.
    label : class name, hold or volume.
    kind : jug, crimp, sloper, pinch, pocket, foot or volume.
    colour : name of the colour.
    rgb : (3,) albedo in sRGB, 0..1.
    route : >= 0; -1 = every route (volume); -2 = no route (downclimb jug).
    position, normal : (3,) world, metres: the mounting point and the wall's outward normal.
    role : hold, foot, start, top, volume or downclimb.
    second : a second colour of the hold, None for most.
    """

    id: int
    label: str
    kind: str
    colour: str
    rgb: tuple[float, float, float]
    route: int
    position: Floats
    normal: Floats
    role: str = "hold"
    body: Body | None = None
    placement: Placement | None = None
    second: SecondColour | None = None
