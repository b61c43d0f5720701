"""Grade ranges for the routes of a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from walltopo.scans.attributes import UNKNOWN
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route
from walltopo_climb.grades.calibrate import Known
from walltopo_climb.grades.features import FEATURES, features
from walltopo_climb.grades.font import parse_grade
from walltopo_climb.grades.model import GradeModel, Range
from walltopo_climb.grades.scale import GymScale
from walltopo_climb.movement.body import ADULT
from walltopo_climb.movement.on_wall import climb_of, on_route
from walltopo_climb.movement.sequence import Climb, find_sequence
from walltopo_climb.movement.sequence import Sequence as Moves

_TYPED = 0.5  # of a route's holds have a type: their quality counts as known


@dataclass(frozen=True)
class Graded:
    """A route on the grade model's scale.

    Parameters
    ----------
    place : the model's; a fraction of a step of `FONT`. known : see `features`.
    """

    route: Route
    place: float
    known: bool


@dataclass(frozen=True)
class Climbed:
    """A route as an adult climbs it.

    Parameters
    ----------
    holds : what one may use on it; `climb` and `moves` count them from 0.
    known : see `features`.
    """

    holds: tuple[HoldRow, ...]
    climb: Climb
    moves: Moves
    known: bool

    @property
    def features(self) -> npt.NDArray[np.float32]:
        """(F,) the input of the grade model."""
        return features(self.climb, self.moves, self.known)


def climb_route(route: Route, holds: Sequence[HoldRow], unit: float) -> Climbed | None:
    """How an adult may go up a route; None where it is no climb, or where not even the start is in
    reach. Whether the top is reached the moves say.

    Parameters
    ----------
    holds : at least those of the route, and the volumes. unit : of the scan, a metre.
    """
    used = on_route(route, holds, unit)
    climb = climb_of(route, used, unit)
    moves = None if climb is None else find_sequence(climb, ADULT)
    if climb is None or moves is None:
        return None
    typed = [hold.type != UNKNOWN for hold in used if hold.role == "hold"]
    return Climbed(used, climb, moves, sum(typed) >= _TYPED * len(typed))


def place_routes(
    routes: Sequence[Route], holds: Sequence[HoldRow], unit: float, model: GradeModel
) -> tuple[Graded, ...]:
    """The routes that an adult climbs, where the model puts them; others are left out."""
    kept, table = [], []
    for route in routes:
        found = climb_route(route, holds, unit)
        if found is None or not found.moves.reached:
            continue
        kept.append((route, found.known))
        table.append(found.features)
    places = model.places(np.array(table, np.float32).reshape(len(table), len(FEATURES)))
    return tuple(
        Graded(route, float(place), known)
        for (route, known), place in zip(kept, places, strict=True)
    )


def grade_routes(graded: Sequence[Graded], model: GradeModel) -> dict[int, Range]:
    """A range for each route, by its id, leaning on the grades that setters gave to the others.

    A route's own grade does not count for its range: else it would only be said back.
    """
    return {
        one.route.id: Scale.of(graded, model, one.route.id).range(one.place, one.known)
        for one in graded
    }


@dataclass(frozen=True)
class Scale:
    """The scale of a wall as its graded routes tell it, and the model that it is of."""

    model: GradeModel
    told: tuple[Known, ...]

    @classmethod
    def of(cls, graded: Sequence[Graded], model: GradeModel, without: int = 0) -> Scale:
        """Of the grades that setters gave; `without`: id of a route that does not count."""
        told = (
            Known(one.place, grade)
            for one in graded
            if one.route.id != without and (grade := parse_grade(one.route.grade)) is not None
        )
        return cls(model, tuple(told))

    @cached_property
    def _scale(self) -> GymScale:
        return GymScale(self.model.learnt, self.told)

    def grade(self, place: float, known: bool) -> float:
        """A place in `FONT` of the model's place, and a fraction."""
        return self._scale.grade(place, known)

    def range(self, place: float, known: bool) -> Range:
        """The range of grades around it."""
        return self._scale.range(place, known)
