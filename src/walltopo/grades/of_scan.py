"""Grade ranges for the routes of a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from walltopo.climbing.body import ADULT
from walltopo.climbing.on_wall import climb_of, on_route
from walltopo.climbing.sequence import find_sequence
from walltopo.grades.calibrate import Known, calibrate
from walltopo.grades.features import features
from walltopo.grades.font import parse_grade
from walltopo.grades.model import GradeModel, Range
from walltopo.scans.attributes import UNKNOWN
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route

__all__ = ["Graded", "grade_routes", "place_routes"]

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


def place_routes(
    routes: Sequence[Route], holds: Sequence[HoldRow], unit: float, model: GradeModel
) -> tuple[Graded, ...]:
    """The routes that an adult climbs, where the model puts them; others are left out."""
    kept, table = [], []
    for route in routes:
        used = on_route(route, holds, unit)
        climb = climb_of(route, used, unit)
        sequence = None if climb is None else find_sequence(climb, ADULT)
        if climb is None or sequence is None or not sequence.reached:
            continue
        typed = [hold.type != UNKNOWN for hold in used if hold.role == "hold"]
        known = sum(typed) >= _TYPED * len(typed)
        kept.append((route, known))
        table.append(features(climb, sequence, known))
    places = model.places(np.array(table, np.float32).reshape(len(table), -1))
    return tuple(
        Graded(route, float(place), known)
        for (route, known), place in zip(kept, places, strict=True)
    )


def grade_routes(graded: Sequence[Graded], model: GradeModel) -> dict[int, Range]:
    """A range for each route, by its id, leaning on the grades that setters gave to the others.

    A route's own grade does not count for its range: else it would only be said back.
    """
    told = {
        one.route.id: Known(one.place, grade)
        for one in graded
        if (grade := parse_grade(one.route.grade)) is not None
    }
    ranges = {}
    for one in graded:
        others = [known for id_, known in told.items() if id_ != one.route.id]
        errors = model.errors(one.known)
        ranges[one.route.id] = (
            calibrate(others, errors).range(one.place)
            if others
            else model.bounded(one.place, errors)
        )
    return ranges
