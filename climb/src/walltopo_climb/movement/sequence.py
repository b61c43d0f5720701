"""Find the likely sequence of moves up a climb, with the crux."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from walltopo.core import InputError
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.grips import Grips
from walltopo_climb.movement.search import find_stances, move_cost
from walltopo_climb.movement.statics import NONE

Limb = Literal["left hand", "right hand", "left foot", "right foot"]
LIMBS: tuple[Limb, ...] = ("left hand", "right hand", "left foot", "right foot")

# Share of the height that a hand may leap beyond reach; a climber's jump lifts the hip by 0.4 m.
MAX_LEAP = 0.25
_STATIC = 0.02  # of the height: lack of reach that leaning and standing on toes make up for
_MAX_SEEN = 200_000  # stances


@dataclass(frozen=True)
class Climb:
    """Holds, and the start and top of a climb (indices into the holds)."""

    grips: Grips
    start: tuple[int, ...]
    top: tuple[int, ...]

    def __post_init__(self) -> None:
        n = len(self.grips)
        if not self.start or not self.top:
            raise InputError("the climb has no start or no top")
        if not all(0 <= i < n for i in (*self.start, *self.top)):
            raise InputError(f"start or top is not among the {n} holds")


@dataclass(frozen=True)
class Move:
    """The move of one limb to a hold.

    Parameters
    ----------
    limb : the moving limb; None for the start.
    limbs : hold of each limb afterwards (`LIMBS`), -1: on none.
    hip : (3,) m, when the limb arrives.
    effort : of holding on during the move, in units of one's weight on one jug, squared.
    beyond : m beyond reach; > 0 for a leap.
    """

    limb: Limb | None
    limbs: tuple[int, int, int, int]
    hip: tuple[float, float, float]
    effort: float
    beyond: float

    @property
    def to(self) -> int:
        """Return the hold to which the limb goes; -1: the limb leaves the wall."""
        return NONE if self.limb is None else self.limbs[LIMBS.index(self.limb)]


@dataclass(frozen=True)
class Sequence:
    """The moves from the start to the top.

    Parameters
    ----------
    body : the climber. moves : the first is the start. crux : index of the hardest hand move.
    reached : whether the sequence ends with both hands on the top; else it ends where both hands
        are as high as this body gets.
    """

    body: Body
    moves: tuple[Move, ...]
    crux: int
    reached: bool


def find_sequence(climb: Climb, body: Body) -> Sequence | None:
    """Return the likely moves, or None if this body cannot even hold the start."""
    grips = climb.grips
    arrays = (grips.position, grips.wall, grips.pull, grips.hand, grips.outward, grips.foot)
    shape = np.array([body.height, body.leg, body.arm, body.torso, body.shoulders / 2])
    # To the right of a climber who faces the wall.
    facing = -grips.wall.mean(axis=0)
    side = np.cross(facing, [0.0, 0.0, 1.0])
    side /= max(float(np.linalg.norm(side)), 1e-9)
    leap = MAX_LEAP * body.height
    stances, reached = find_stances(
        *arrays, side, np.array(climb.start), np.array(climb.top), shape, leap, _MAX_SEEN
    )
    if not len(stances):
        return None
    moves: list[Move] = []
    for k, stance in enumerate(stances):
        moving = 4 if k == 0 else int(np.flatnonzero(stance != stances[k - 1])[0])
        moves.append(_move(arrays, stance, moving, shape, body))
    hands = [k for k, move in enumerate(moves) if k and move.limb in LIMBS[:2]]
    crux = max(hands, key=lambda k: moves[k].effort, default=0)
    return Sequence(body, tuple(moves), crux, bool(reached))


def longest_reach(climb: Climb, sequence: Sequence) -> float:
    """Return the longest distance in metres between the holds of both hands at once."""
    hands = np.array([move.limbs[:2] for move in sequence.moves])
    ends = climb.grips.position[hands[(hands != NONE).all(axis=1)]]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max(initial=0.0))


def _move(
    arrays: tuple[npt.NDArray[np.float64], ...],
    stance: npt.NDArray[np.int64],
    moving: int,
    shape: npt.NDArray[np.float64],
    body: Body,
) -> Move:
    hip = np.zeros(3)
    cost, lack = move_cost(*arrays, stance, moving, shape, np.inf, hip)
    a, b, c, d = (int(i) for i in stance)
    x, y, z = (float(v) for v in hip)
    beyond = float(lack) if lack > _STATIC * body.height else 0.0
    return Move(LIMBS[moving] if moving < 4 else None, (a, b, c, d), (x, y, z), float(cost), beyond)
