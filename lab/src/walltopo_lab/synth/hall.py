"""The layout of several walls around a floor, each built in its own frame.

A wall's own frame is that of `wall.build_wall`: it begins at the origin, runs along x and faces -y.
In the hall the walls stand on the sides of a regular polygon with a gap between neighbours. They
follow the order of a walk with the wall on the left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.similarity import Similarity
from walltopo_lab.synth.bodies import Facet, GymInstance, Placement
from walltopo_lab.synth.params import GymSettings

Floats = NDArray[np.float64]

_GAP = 1.0  # m between two walls, along the side of the polygon
_MIN_ROOM = 5.5  # m from a wall to the hall's middle: room to photograph it from
_FLOOR = 7.0  # m of mats in front of a wall


@dataclass(frozen=True, eq=False)
class Stand:
    """The position of a wall in the hall.

    Parameters
    ----------
    hall_from_wall : from the wall's own frame to the hall's; scale 1, z stays up.
    middle : (3,) the hall's middle on the floor, in the wall's frame.
    half_turn : half of the angle to the next wall, radians.
    """

    hall_from_wall: Similarity
    middle: Floats
    half_turn: float

    @property
    def joint(self) -> Floats:
        """Return the (3,) floor point half way to the next wall, in this wall's frame."""
        return self.middle + np.array([self._half_width(0.0), -self.middle[1], 0.0])

    def _half_width(self, y: float) -> float:
        """Return half the width of this wall's bay at a `y` of its frame."""
        return float((y - self.middle[1]) * np.tan(self.half_turn))

    def across(self, y: float) -> tuple[float, float]:
        """Return the x interval of this wall's bay at a `y` of its frame."""
        half = self._half_width(y)
        return float(self.middle[0]) - half, float(self.middle[0]) + half


@dataclass(frozen=True, eq=False)
class Section:
    """A wall and its scale plates in the wall's own frame; `stand` is None for a single wall."""

    wall: list[Facet]
    plates: list[Facet]
    stand: Stand | None

    @property
    def hall_from_wall(self) -> Similarity:
        return identity_frame() if self.stand is None else self.stand.hall_from_wall


def identity_frame() -> Similarity:
    """Return the identity: the hall's frame of a single-wall gym is that wall's own."""
    return Similarity(1.0, np.eye(3), np.zeros(3))


def ring_of_walls(walls: int, width: float) -> list[Stand]:
    """Return the stands of `walls` (4 or more) walls of `width` metres around the hall's origin."""
    half_turn = np.pi / walls
    room = max((width + _GAP) / 2 / np.tan(half_turn), _MIN_ROOM)
    middle = np.array([width / 2, -room, 0.0])
    stands = []
    for number in range(walls):
        c, s = np.cos(2 * half_turn * number), np.sin(2 * half_turn * number)
        rotation = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        stands.append(Stand(Similarity(1.0, rotation, -rotation @ middle), middle, half_turn))
    return stands


def hall_bay(stand: Stand, settings: GymSettings, back: float, style: int) -> list[Facet]:
    """Return mats before a wall, concrete behind it and the ceiling, up to the neighbouring bays.

    Parameters
    ----------
    back : y of the concrete in the wall's frame.
    style : style of the concrete.

    Returns
    -------
    Facets in the wall's frame.
    """
    front = -min(_FLOOR, -float(stand.middle[1]) - 0.5)
    (left, right), (near_left, near_right) = stand.across(back), stand.across(front)
    roof = settings.height + 1.6
    floor = [[near_left, front, 0], [near_right, front, 0], [right, back, 0], [left, back, 0]]
    rear = [[left, back, 0], [right, back, 0], [right, back, roof], [left, back, roof]]
    ceiling = [[x, y, roof] for x, y, _ in floor[::-1]]
    return [
        Facet(np.array(floor, float), "floor", texel=0.006),
        Facet(np.array(rear, float), "concrete", texel=0.008, style=style),
        Facet(np.array(ceiling, float), "ceiling", texel=0.012),
    ]


def moved_facet(facet: Facet, move: Similarity, ids: int = 0) -> Facet:
    """Return a facet in another frame, with the id of its volume, if any, raised by `ids`."""
    instance = facet.instance + ids if facet.instance else 0
    return replace(facet, corners=move.apply(facet.corners), instance=instance)


def moved_instance(item: GymInstance, move: Similarity, ids: int, routes: int) -> GymInstance:
    """Return an instance in another frame, with its id and its route number, if any, raised."""
    placement = item.placement
    if placement is not None:
        placement = Placement(move.rotation @ placement.rotation, move.apply(placement.origin))
    return replace(
        item,
        id=item.id + ids,
        route=item.route + routes if item.route >= 0 else item.route,
        position=move.apply(item.position),
        normal=move.rotation @ item.normal,
        placement=placement,
    )


def moved_pose(cam_from_wall: Floats, move: Similarity) -> Floats:
    """Return the (3, 4) cam_from_hall of a (3, 4) cam_from_wall."""
    rotation = cam_from_wall[:, :3] @ move.rotation.T
    return np.column_stack([rotation, cam_from_wall[:, 3] - rotation @ move.translation])
