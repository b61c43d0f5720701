"""The holds on which a problem may be set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from walltopo.scans.holds import Hold
from walltopo_climb.movement.body import Body
from walltopo_climb.problems.spec import HOLD_KINDS, STEEPNESS_DEG, ProblemSpec

Floats = npt.NDArray[np.float64]

_SMALL, _LARGE = 0.08, 0.16  # m: maximum size of a small hold, and minimum size of a large one
_FOOT = "foothold"
_LOW, _HIGH = 0.25, 1.05  # of the height above the floor: range of hand starts


@dataclass(frozen=True)
class Pool:
    """The holds of a wall that problems may use.

    Parameters
    ----------
    rows : all holds of the wall. unit : scan units per metre. floor : height of the floor, in scan
        units.
    """

    rows: tuple[Hold, ...]
    unit: float
    floor: float

    @classmethod
    def of(cls, holds: Sequence[Hold], unit: float, floor_known: bool) -> Pool:
        """Return the pool of a scan; an unknown floor is set a little below the lowest hold."""
        lowest = min((hold.position[2] for hold in holds), default=0.0)
        return cls(tuple(holds), unit, 0.0 if floor_known else lowest - 0.3 * unit)

    @cached_property
    def by_id(self) -> dict[int, Hold]:
        return {hold.id: hold for hold in self.rows}

    @cached_property
    def volumes(self) -> tuple[Hold, ...]:
        return tuple(hold for hold in self.rows if hold.role == "volume")

    @cached_property
    def ids(self) -> npt.NDArray[np.int64]:
        """Return (N,) ids of the usable holds: no volumes, no downclimb holds."""
        return np.array([hold.id for hold in self.rows if hold.role == "hold"], np.int64)

    @cached_property
    def row_of(self) -> dict[int, int]:
        """Return hold id to row in `ids`."""
        return {int(number): k for k, number in enumerate(self.ids)}

    @cached_property
    def position(self) -> Floats:
        """Return (N, 3) positions in metres, the floor at z = 0."""
        places = np.array([self.by_id[int(i)].position for i in self.ids]).reshape(-1, 3)
        places[:, 2] -= self.floor
        return places / self.unit

    @cached_property
    def distances(self) -> Floats:
        """Return (N, N) metres from hold to hold."""
        return np.asarray(np.linalg.norm(self.position[:, None] - self.position[None], axis=2))

    @cached_property
    def hands(self) -> npt.NDArray[np.bool_]:
        """Return (N,) whether hands may use the hold."""
        return np.array([self.by_id[int(i)].type != _FOOT for i in self.ids], bool)

    def near(self, numbers: Sequence[int]) -> tuple[Hold, ...]:
        """Return these holds and all volumes, in the order of ids."""
        wanted = {*numbers, *(hold.id for hold in self.volumes)}
        return tuple(self.by_id[number] for number in sorted(wanted))

    def starts(self, body: Body) -> npt.NDArray[np.bool_]:
        """Return (N,) whether this body may start there with a hand."""
        z = self.position[:, 2]
        return self.hands & (z > _LOW * body.height) & (z < _HIGH * body.height)

    def weights(self, spec: ProblemSpec) -> Floats:
        """Return (N,) sampling weights of the holds for hands."""
        rows = [self.by_id[int(i)] for i in self.ids]
        kind = np.array([fits_kind(hold, spec, self.unit) for hold in rows], bool)
        wall = np.array([fits_steepness(hold, spec) for hold in rows], bool)
        return np.where(kind, 1.0, 0.2) * np.where(wall, 1.0, 0.1) * self.hands


def fits_kind(hold: Hold, spec: ProblemSpec, unit: float) -> bool:
    """Return whether a hold is of the requested kind."""
    if spec.holds == "any":
        return True
    if spec.holds == "small":
        return hold.size <= _SMALL * unit
    if spec.holds == "large":
        return hold.size >= _LARGE * unit
    return hold.type in HOLD_KINDS[spec.holds]


def fits_steepness(hold: Hold, spec: ProblemSpec) -> bool:
    """Return whether the wall under a hold has the requested steepness."""
    if spec.steepness == "any":
        return True
    low, high = STEEPNESS_DEG[spec.steepness]
    return low <= hold.steepness_deg <= high
