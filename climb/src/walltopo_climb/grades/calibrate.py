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

from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.model import Errors, Range, range_of

Floats = npt.NDArray[np.float64]

# Prior standard deviations, in steps of the scale. One step is what the two set-ups of the board
# differ by when one's model grades the other; gyms, which grade for customers, get the double.
_OFFSET, _SLOPE = 2.0, 0.3
_SETTER = 0.7  # of a setter's grade around what climbers agree on; of one vote it is
_VOTE = 1.2  # published: one step, for experienced climbers (Draper et al. 2015)
OWN_ERRORS = 20  # graded climbs from which a gym's errors say how wide ranges are
_MIDDLE = (FONT.index("6A") + FONT.index("7A")) / 2  # the centre where no climb is


@dataclass(frozen=True)
class Known:
    """A graded climb.

    Parameters
    ----------
    place : the model's. grade : as a place in `FONT`.
    votes : how many made the grade; 0: a setter's.
    width : steps from the easiest to the hardest grade that it may mean, such as a circuit's.
    """

    place: float
    grade: float
    votes: int = 0
    width: float = 0.0

    @property
    def variance(self) -> float:
        """Of the grade around what a crowd would agree on."""
        said = _SETTER**2 if self.votes == 0 else _VOTE**2 / self.votes
        # Of grades that are equally likely, `width` + 1 of them.
        return said + ((self.width + 1) ** 2 - 1) / 12


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
    told = _Told.of(known, errors)
    line, covariance = told.line()
    widths = errors.bound / errors.spread
    if len(known) >= OWN_ERRORS:
        # The conformal quantile of the gym's own errors, each from a line without that climb.
        middle, deviation = told.left_out()
        off = np.sort(np.abs(told.grade - middle) / deviation)
        rank = math.ceil(errors.coverage * (len(off) + 1))
        widths = float(off[min(rank, len(off)) - 1])
    return Gym(told.centre, line, covariance, errors, widths, len(known))


def left_out(known: Sequence[Known], errors: Errors) -> tuple[Range, ...]:
    """The range of each of these climbs, as the others tell the gym's scale."""
    widths = calibrate(known, errors).widths
    middle, deviation = _Told.of(known, errors).left_out()
    spans = (range_of(float(m), widths * float(d)) for m, d in zip(middle, deviation, strict=True))
    return tuple(Range(*span, errors.coverage, len(known) - 1) for span in spans)


@dataclass(frozen=True)
class _Told:
    """(N,) graded climbs: places from their centre, grades, weights; and the model's spread."""

    centre: float
    place: Floats
    grade: Floats
    weight: Floats
    spread: float

    @classmethod
    def of(cls, known: Sequence[Known], errors: Errors) -> _Told:
        place = np.array([one.place for one in known], float)
        centre = float(place.mean()) if len(known) else _MIDDLE
        noise = errors.spread**2 + np.array([one.variance for one in known], float)
        grade = np.array([one.grade for one in known], float)
        return cls(centre, place - centre, grade, 1 / noise, errors.spread)

    def line(self) -> tuple[Floats, Floats]:
        """Posterior mean and covariance of grade at the centre and slope."""
        precision, pull = self._sums()
        covariance = np.asarray(np.linalg.inv(precision), float)
        return covariance @ pull, covariance

    def left_out(self) -> tuple[Floats, Floats]:
        """(N,) grade of each climb from the line without it, and the deviation to expect."""
        at = np.stack([np.ones_like(self.place), self.place], axis=1)
        precision, pull = self._sums()
        own = self.weight[:, None] * at
        covariance = np.linalg.inv(precision - own[:, :, None] * at[:, None, :])
        rest = np.einsum("nij,nj->ni", covariance, pull - own * self.grade[:, None])
        variance = self.spread**2 + np.einsum("ni,nij,nj->n", at, covariance, at)
        return (at * rest).sum(axis=1), np.asarray(np.sqrt(variance), float)

    def _sums(self) -> tuple[Floats, Floats]:
        """Precision and precision times mean, of the prior and of all that is told."""
        at = np.stack([np.ones_like(self.place), self.place], axis=1)
        prior = np.diag([_OFFSET**-2, _SLOPE**-2])
        precision = prior + (self.weight[:, None] * at).T @ at
        pull = prior @ np.array([self.centre, 1.0]) + at.T @ (self.weight * self.grade)
        return precision, pull
