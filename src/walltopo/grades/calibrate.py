"""A gym's own scale: what its setters' grades and its climbers' votes tell about the model.

Each gym grades a little softer or harder than a board, and stretches the scale its own way. So the
gym's grade is a straight line in the model's place, with a prior that says "as the board does"
(normal, conjugate: Gelman et al., "Bayesian Data Analysis", 14.2 and 14.8). With no grade the prior
stands; each grade pulls the line as far as it deserves, votes by their number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from walltopo.grades.font import FONT
from walltopo.grades.model import Errors, Range, range_of

__all__ = ["Gym", "Known", "calibrate"]

Floats = npt.NDArray[np.float64]

# Prior standard deviations, in steps of the scale. One step is what the two set-ups of the board
# differ by when one's model grades the other; gyms, which grade for customers, get the double.
_OFFSET, _SLOPE = 2.0, 0.3
_SETTER = 0.7  # of a setter's grade around what climbers agree on; of one vote it is
_VOTE = 1.2  # published: one step, for experienced climbers (Draper et al. 2015)
_OWN_ERRORS = 20  # graded climbs from which a gym's errors say how wide ranges are


@dataclass(frozen=True)
class Known:
    """A graded climb: the model's place, the grade as a place in `FONT`, and how many votes made
    it (0: a setter's grade)."""

    place: float
    grade: float
    votes: int = 0

    @property
    def variance(self) -> float:
        """Of the grade around what a crowd would agree on."""
        return _SETTER**2 if self.votes == 0 else _VOTE**2 / self.votes


@dataclass(frozen=True)
class Gym:
    """A gym's scale; `calibrate` makes it.

    Parameters
    ----------
    centre : of the model's places. line : (2,) grade at the centre, and slope.
    covariance : (2, 2) of the line. errors : of the model on climbs of this gym.
    widths : half width of a range over the predicted standard deviation.
    graded : climbs that it leans on.
    """

    centre: float
    line: Floats
    covariance: Floats
    errors: Errors
    widths: float
    graded: int

    def place(self, place: float) -> tuple[float, float]:
        """A grade as a place in `FONT`, and its standard deviation, of the model's place."""
        at = np.array([1.0, place - self.centre])
        variance = self.errors.spread**2 + float(at @ self.covariance @ at)
        return float(at @ self.line), math.sqrt(variance)

    def range(self, place: float) -> Range:
        """The range of a climb of this gym."""
        middle, deviation = self.place(place)
        low, high = range_of(middle, self.widths * deviation)
        return Range(low, high, self.errors.coverage, self.graded)


def calibrate(known: Sequence[Known], errors: Errors) -> Gym:
    """A gym's scale from its graded climbs, none to hundreds.

    Parameters
    ----------
    errors : of the model elsewhere.
    """
    middle = (FONT.index("6A") + FONT.index("7A")) / 2
    places = np.array([one.place for one in known])
    centre = float(places.mean()) if len(known) else middle
    widths = errors.bound / errors.spread
    line, covariance = _line(known, centre, errors)
    gym = Gym(centre, line, covariance, errors, widths, len(known))
    if len(known) < _OWN_ERRORS:
        return gym
    off = _left_out(known, centre, errors)
    # The conformal quantile of the gym's own errors, each from a line without that climb.
    rank = math.ceil(errors.coverage * (len(off) + 1))
    own = float(np.sort(off)[min(rank, len(off)) - 1])
    return Gym(centre, line, covariance, errors, own, len(known))


def _line(known: Sequence[Known], centre: float, errors: Errors) -> tuple[Floats, Floats]:
    """Posterior mean and covariance of grade at the centre and slope."""
    precision = np.diag([_OFFSET**-2, _SLOPE**-2])
    pull = precision @ np.array([centre, 1.0])
    for one in known:
        at = np.array([1.0, one.place - centre])
        weight = 1 / (errors.spread**2 + one.variance)
        precision = precision + weight * np.outer(at, at)
        pull = pull + weight * one.grade * at
    covariance = np.linalg.inv(precision)
    return covariance @ pull, covariance


def _left_out(known: Sequence[Known], centre: float, errors: Errors) -> Floats:
    """(N,) error of each climb over its predicted deviation, from the line without it."""
    line, covariance = _line(known, centre, errors)
    precision = np.linalg.inv(covariance)
    pull = precision @ line
    off = np.zeros(len(known))
    for k, one in enumerate(known):
        at = np.array([1.0, one.place - centre])
        weight = 1 / (errors.spread**2 + one.variance)
        without = np.linalg.inv(precision - weight * np.outer(at, at))
        rest = without @ (pull - weight * one.grade * at)
        deviation = math.sqrt(errors.spread**2 + float(at @ without @ at))
        off[k] = abs(one.grade - float(at @ rest)) / deviation
    return off
