"""The holds that a problem may be set on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from walltopo.scans.holds import HoldRow
from walltopo_climb.movement.body import Body
from walltopo_climb.problems.wish import HOLD_KINDS, STEEPNESS_DEG, Wish

Floats = npt.NDArray[np.float64]

_SMALL, _LARGE = 0.08, 0.16  # m: a hold up to, and from which on, it counts as small or large
_FOOT = "foothold"
_LOW, _HIGH = 0.25, 1.05  # of the height above the floor: there hands start


@dataclass(frozen=True)
class Pool:
    """Holds of a wall.

    Parameters
    ----------
    rows : of the wall, all of them. unit : of the scan, a metre. floor : its height, in the scan's
        units.
    """

    rows: tuple[HoldRow, ...]
    unit: float
    floor: float

    @classmethod
    def of(cls, holds: Sequence[HoldRow], unit: float, floor_known: bool) -> Pool:
        """The pool of a scan; where the floor is not known it is a little below the lowest hold."""
        lowest = min((hold.position[2] for hold in holds), default=0.0)
        return cls(tuple(holds), unit, 0.0 if floor_known else lowest - 0.3 * unit)

    @cached_property
    def by_id(self) -> dict[int, HoldRow]:
        return {hold.id: hold for hold in self.rows}

    @cached_property
    def volumes(self) -> tuple[HoldRow, ...]:
        return tuple(hold for hold in self.rows if hold.role == "volume")

    @cached_property
    def ids(self) -> npt.NDArray[np.int64]:
        """(N,) of what a problem may be set on: no volumes, no holds for climbing down."""
        return np.array([hold.id for hold in self.rows if hold.role == "hold"], np.int64)

    @cached_property
    def row_of(self) -> dict[int, int]:
        """Hold id to its place in `ids`."""
        return {int(number): k for k, number in enumerate(self.ids)}

    @cached_property
    def place(self) -> Floats:
        """(N, 3) metres, the floor at z = 0."""
        places = np.array([self.by_id[int(i)].position for i in self.ids]).reshape(-1, 3)
        places[:, 2] -= self.floor
        return places / self.unit

    @cached_property
    def apart(self) -> Floats:
        """(N, N) metres from hold to hold."""
        return np.asarray(np.linalg.norm(self.place[:, None] - self.place[None], axis=2))

    @cached_property
    def hands(self) -> npt.NDArray[np.bool_]:
        """(N,) whether hands may take it."""
        return np.array([self.by_id[int(i)].type != _FOOT for i in self.ids], bool)

    def near(self, numbers: Sequence[int]) -> tuple[HoldRow, ...]:
        """These holds and all volumes, in the order of the wall's table."""
        wanted = {*numbers, *(hold.id for hold in self.volumes)}
        return tuple(self.by_id[number] for number in sorted(wanted))

    def starts(self, body: Body) -> npt.NDArray[np.bool_]:
        """(N,) whether this body may begin there with a hand."""
        z = self.place[:, 2]
        return self.hands & (z > _LOW * body.height) & (z < _HIGH * body.height)

    def liked(self, wish: Wish) -> Floats:
        """(N,) how much more often than others a hold is tried for the hands."""
        rows = [self.by_id[int(i)] for i in self.ids]
        kind = np.array([fits_kind(hold, wish, self.unit) for hold in rows], bool)
        wall = np.array([fits_steepness(hold, wish) for hold in rows], bool)
        return np.where(kind, 1.0, 0.2) * np.where(wall, 1.0, 0.1) * self.hands


def fits_kind(hold: HoldRow, wish: Wish, unit: float) -> bool:
    """Whether a hold is of the wished kind."""
    if wish.holds == "any":
        return True
    if wish.holds == "small":
        return hold.size <= _SMALL * unit
    if wish.holds == "large":
        return hold.size >= _LARGE * unit
    return hold.type in HOLD_KINDS[wish.holds]


def fits_steepness(hold: HoldRow, wish: Wish) -> bool:
    """Whether the wall under a hold is as steep as wished."""
    if wish.steepness == "any":
        return True
    low, high = STEEPNESS_DEG[wish.steepness]
    return low <= hold.steepness_deg <= high
