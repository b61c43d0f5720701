"""Model the maximum force that each hold can bear, and its directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from walltopo.core import InputError

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TypeGrip:
    """The properties of a hold type for the hand.

    Parameters
    ----------
    quality : maximum force as a share of that on a jug. Crimp, pocket and sloper after the forces
        measured on holds by Amca et al. (2012, depth of the hold) and Vigouroux et al. (2006,
        2019, grip technique); pinch after Schweizer (2012). The forces vary widely between
        climbers and are rounded to a tenth here.
    outward : share of the force that is lost when pulled straight off the wall; estimated from the
        shape (a jug is behind the fingers, a sloper is friction alone).
    """

    quality: float
    outward: float


TYPES = {
    "jug": TypeGrip(1.0, 0.1),
    "rail": TypeGrip(0.9, 0.2),
    "edge": TypeGrip(0.6, 0.4),
    "pocket": TypeGrip(0.6, 0.3),
    "pinch": TypeGrip(0.5, 0.5),
    "crimp": TypeGrip(0.5, 0.4),
    "sloper": TypeGrip(0.4, 0.8),
    "volume": TypeGrip(0.3, 0.9),
    "foothold": TypeGrip(0.2, 0.6),
}
NEUTRAL = TypeGrip(0.6, 0.4)  # a hold of unknown type
FOOT_ONLY = 0.0  # quality of a hold for feet only
_WHOLE_HAND = 0.12  # m: a larger hold is no better (breadth of a hand and a bit)
_SMALLEST = 0.3  # quality of the smallest hold as a share of its type's quality


@dataclass(frozen=True)
class Grips:
    """The holds of one climb.

    Parameters
    ----------
    position : (N, 3) metres, z up. wall : (N, 3) unit, out of the wall under each.
    pull : (N, 3) unit, along the wall: the direction of pull in which the hold bears most.
    hand : (N,) force it bears as a share of a jug, in [0, 1]; 0: for feet only.
    outward : (N,) see `TypeGrip`.
    foot : (N,) share of the body's weight that a foot can put on it, in [0, 1].

    Raises
    ------
    InputError : shapes differ, or a value is not finite.
    """

    position: Floats
    wall: Floats
    pull: Floats
    hand: Floats
    outward: Floats
    foot: Floats

    def __post_init__(self) -> None:
        n = len(self.position)
        for name in ("position", "wall", "pull"):
            if getattr(self, name).shape != (n, 3):
                raise InputError(f"{name}: {getattr(self, name).shape}, expected ({n}, 3)")
        for name in ("hand", "outward", "foot"):
            if getattr(self, name).shape != (n,):
                raise InputError(f"{name}: {getattr(self, name).shape}, expected ({n},)")
        if not all(np.isfinite(value).all() for value in vars(self).values()):
            raise InputError("a hold's position, direction or quality is not finite")

    def __len__(self) -> int:
        return len(self.position)


def hand_quality(kind: str, size: float) -> float:
    """Return the force that a hold of a type and size (m) bears, as a share of a large jug."""
    grip = TYPES.get(kind, NEUTRAL)
    return grip.quality * (_SMALLEST + (1 - _SMALLEST) * min(size / _WHOLE_HAND, 1.0))


def foot_share(steepness_deg: Floats) -> Floats:
    """Return the share of the body's weight that feet put on a hold of a wall of this steepness.

    The share is two thirds to four fifths on vertical walls and less on steeper ones, as measured
    by Noé, Quaine and Martin (2001); linear in between.
    """
    return np.interp(steepness_deg, [-20.0, 0.0, 40.0, 90.0], [0.95, 0.80, 0.60, 0.30])


def best_pull(normal: Floats, wall: Floats) -> Floats:
    """Return the (N, 3) unit direction along the wall in which each hold bears most.

    A hold leans by the difference of its mean normal from the wall's: a hold that leans up is
    pulled down, one that leans left is pulled to the right. A hold that hardly leans is pulled
    down, because setters turn holds so.

    Parameters
    ----------
    normal : (N, 3) unit, of the holds. wall : (N, 3) unit, of the wall under them.
    """
    lean = normal - (normal * wall).sum(axis=1, keepdims=True) * wall
    down = -np.array([0.0, 0.0, 1.0]) + wall[:, 2:] * wall
    length = np.linalg.norm(down, axis=1, keepdims=True)
    # Under a roof no direction along the wall points down: any direction is equally good.
    down = np.where(length > 0.1, down / np.maximum(length, 0.1), 0.0)
    pull = down - lean
    size = np.linalg.norm(pull, axis=1, keepdims=True)
    return np.where(size > 1e-6, pull / np.maximum(size, 1e-6), down)
