"""The nouns of a generated gym: bodies, facets, instances, the gym itself."""

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
    chalk : (V,) float32 in [0, 1], how much a hand rubs there.
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


@dataclass(frozen=True, eq=False)
class Facet:
    """A plane polygon with a painted bitmap: a piece of wall, volume, floor or building.

    Parameters
    ----------
    corners : (3 or 4, 3) float64 world, counter-clockwise seen from outside.
    kind : what is painted on it: wall, fin, volume, dome (a patch of a round volume), floor, plate,
        concrete, ceiling.
    instance : id of the volume it belongs to, 0 = none.
    texel : size of a texel, metres.
    style : free number that its painter understands (colour number, plate number).
    """

    corners: Floats
    kind: str
    instance: int = 0
    texel: float = 0.003
    style: int = 0

    @cached_property
    def frame(self) -> tuple[Floats, Floats, Floats]:
        """Unit u (level, to the right seen from outside), v (up the facet), n (outward)."""
        a, b, c = self.corners[:3]
        normal = np.cross(b - a, c - a)
        if self.kind == "plate":  # the print follows the plate's own edges
            u, n = (b - a) / np.linalg.norm(b - a), normal / np.linalg.norm(normal)
            return u, np.cross(n, u), n
        return frame_of(normal)

    def chart(self, points: Floats) -> Floats:
        """(..., 2) metres in the facet's plane of world points (..., 3), origin corner 0."""
        u, v, _ = self.frame
        relative = points - self.corners[0]
        return np.stack([relative @ u, relative @ v], axis=-1)

    def inside(self, point: Floats) -> float:
        """Distance of a point in the plane to the nearest edge, negative outside; metres."""
        uv = self.chart(self.corners)
        p = self.chart(point)
        edges = np.roll(uv, -1, axis=0) - uv
        lengths = np.linalg.norm(edges, axis=1)
        to_point = p - uv
        cross = edges[:, 0] * to_point[:, 1] - edges[:, 1] * to_point[:, 0]
        return float((cross / lengths).min())

    def carries(self, point: Floats) -> bool:
        """Whether a point lies on the facet (within 5 cm of its plane)."""
        return abs((point - self.corners[0]) @ self.frame[2]) < 0.05 and self.inside(point) > 0


def frame_of(normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Right-handed unit (u, v, n) with u level; for a level plane u = x."""
    n = normal / np.linalg.norm(normal)
    u = np.cross([0.0, 0.0, 1.0], n)
    length = np.linalg.norm(u)
    u = u / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    return u, np.cross(n, u), n


@dataclass(frozen=True, eq=False)
class Placement:
    """Where a body is bolted: world_from_body rotation (3, 3) and origin (3,), metres."""

    rotation: Floats
    origin: Floats


@dataclass(frozen=True, eq=False)
class GymInstance:
    """One object of the truth, as in `scene.json`.

    Parameters
    ----------
    id : >= 1, the value in `face_instance`.
    label : class name, hold or volume.
    kind : jug, crimp, sloper, pinch, pocket, foot or volume.
    colour : its colour's name.
    rgb : (3,) albedo in sRGB, 0..1.
    route : >= 0; -1 belongs to every route (volume); -2 to none (downclimb jug).
    position, normal : (3,) world, metres: where it is mounted and the wall's outward normal.
    role : hold, foot, start, top, volume or downclimb.
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
