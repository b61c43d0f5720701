"""Estimate grade ranges for the routes of a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from walltopo.scans.holds import UNKNOWN, Hold
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

_MIN_TYPED = 0.5  # minimum share of holds with a type for the quality to count as known


@dataclass(frozen=True)
class Graded:
    """A route on the grade model's scale.

    Parameters
    ----------
    difficulty : the model's difficulty, a fractional index into `FONT`. known : see `features`.
    """

    route: Route
    difficulty: float
    known: bool


@dataclass(frozen=True)
class Climbed:
    """The moves of an adult on a route.

    Parameters
    ----------
    holds : the holds that may be used; `climb` and `moves` index them.
    known : see `features`.
    """

    holds: tuple[Hold, ...]
    climb: Climb
    moves: Moves
    known: bool

    @property
    def features(self) -> npt.NDArray[np.float32]:
        """Return the (F,) input of the grade model."""
        return features(self.climb, self.moves, self.known)


def climb_route(route: Route, holds: Sequence[Hold], unit: float) -> Climbed | None:
    """Return the moves of an adult, or None if the route is no climb or its start is out of reach.

    The moves include whether the top is reached.

    Parameters
    ----------
    holds : at least those of the route, and the volumes. unit : scan units per metre.
    """
    used = on_route(route, holds, unit)
    climb = climb_of(route, used, unit)
    moves = None if climb is None else find_sequence(climb, ADULT)
    if climb is None or moves is None:
        return None
    typed = [hold.type != UNKNOWN for hold in used if hold.role == "hold"]
    return Climbed(used, climb, moves, sum(typed) >= _MIN_TYPED * len(typed))


def rate_routes(
    routes: Sequence[Route], holds: Sequence[Hold], unit: float, model: GradeModel
) -> tuple[Graded, ...]:
    """Return the routes that an adult can climb, each with its difficulty; omit the others."""
    kept, table = [], []
    for route in routes:
        found = climb_route(route, holds, unit)
        if found is None or not found.moves.reached:
            continue
        kept.append((route, found.known))
        table.append(found.features)
    difficulties = model.difficulties(
        np.array(table, np.float32).reshape(len(table), len(FEATURES))
    )
    return tuple(
        Graded(route, float(difficulty), known)
        for (route, known), difficulty in zip(kept, difficulties, strict=True)
    )


def grade_routes(graded: Sequence[Graded], model: GradeModel) -> dict[int, Range]:
    """Return a range for each route by id, calibrated by the setters' grades of the others.

    A route's own grade is excluded: the range would only repeat it.
    """
    return {
        one.route.id: Scale.of(graded, model, one.route.id).range(one.difficulty, one.known)
        for one in graded
    }


@dataclass(frozen=True)
class Scale:
    """The grade scale of a wall, calibrated by its graded routes."""

    model: GradeModel
    gym_grades: tuple[Known, ...]

    @classmethod
    def of(cls, graded: Sequence[Graded], model: GradeModel, without: int = 0) -> Scale:
        """Return the scale from the setters' grades, excluding the route with id `without`."""
        gym_grades = (
            Known(one.difficulty, grade)
            for one in graded
            if one.route.id != without and (grade := parse_grade(one.route.grade)) is not None
        )
        return cls(model, tuple(gym_grades))

    @cached_property
    def _scale(self) -> GymScale:
        return GymScale(self.model.learnt, self.gym_grades)

    def grade(self, difficulty: float, known: bool) -> float:
        """Return the grade at a model's difficulty, as a fractional index into `FONT`."""
        return self._scale.grade(difficulty, known)

    def range(self, difficulty: float, known: bool) -> Range:
        """Return the range of grades around a model's difficulty."""
        return self._scale.range(difficulty, known)
