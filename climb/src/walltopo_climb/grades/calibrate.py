"""Calibrate the model to a gym's own scale, by its setters' grades and its climbers' votes.

Each gym grades a little softer or harder than a board, and stretches the scale its own way. The
grade of a gym is therefore linear in the model's difficulty, with a prior of "as on the board"
(normal, conjugate: Gelman et al., "Bayesian Data Analysis", 14.2 and 14.8). Without any grade the
prior remains. Each grade moves the line by its weight, votes by their number.
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

# Prior standard deviations, in steps of the scale. The two set-ups of the board differ by one step
# when the model of one grades the other; gyms, which grade for customers, get twice that.
_OFFSET, _SLOPE = 2.0, 0.3
_SETTER = 0.7  # standard deviation of a setter's grade around the climbers' consensus
_VOTE = 1.2  # of one vote; published: one step, for experienced climbers (Draper et al. 2015)
OWN_ERRORS = 20  # minimum number of graded climbs for range widths from a gym's own errors
_MIDDLE = (FONT.index("6A") + FONT.index("7A")) / 2  # the centre without graded climbs


@dataclass(frozen=True)
class Known:
    """A graded climb.

    Parameters
    ----------
    difficulty : the model's difficulty. grade : as an index into `FONT`.
    votes : number of votes behind the grade; 0 for a setter's.
    width : steps from the easiest to the hardest grade that the label may mean, as for a circuit.
    """

    difficulty: float
    grade: float
    votes: int = 0
    width: float = 0.0

    @property
    def variance(self) -> float:
        """Return the variance of the grade around the consensus of many climbers."""
        vote_variance = _SETTER**2 if self.votes == 0 else _VOTE**2 / self.votes
        # Variance of a uniform distribution over `width` + 1 grades.
        return vote_variance + ((self.width + 1) ** 2 - 1) / 12


@dataclass(frozen=True)
class Gym:
    """A gym's scale, see `calibrate`.

    Parameters
    ----------
    centre : of the model's difficulties. line : (2,) grade at the centre, and slope.
    covariance : (2, 2) of the line. errors : the model's errors on climbs of this gym.
    widths : half width of a range over the predicted standard deviation.
    graded : number of climbs behind the calibration.
    """

    centre: float
    line: Floats
    covariance: Floats
    errors: Errors
    widths: float
    graded: int

    def grade_at(self, difficulty: float) -> tuple[float, float]:
        """Return the gym's grade as an index into `FONT`, and its standard deviation."""
        at = np.array([1.0, difficulty - self.centre])
        variance = self.errors.spread**2 + float(at @ self.covariance @ at)
        return float(at @ self.line), math.sqrt(variance)

    def range(self, difficulty: float) -> Range:
        """Return the grade range of a climb of this gym."""
        middle, deviation = self.grade_at(difficulty)
        low, high = range_of(middle, self.widths * deviation)
        return Range(low, high, self.errors.coverage, self.graded)


def calibrate(known: Sequence[Known], errors: Errors) -> Gym:
    """Return a gym's scale from its graded climbs, of which there may be none.

    Parameters
    ----------
    errors : the model's errors on other climbs.
    """
    sums = _GradeSums.of(known, errors)
    line, covariance = sums.line()
    widths = errors.bound / errors.spread
    if len(known) >= OWN_ERRORS:
        # The conformal quantile of the gym's own errors, each from a line without that climb.
        middle, deviation = sums.leave_one_out()
        off = np.sort(np.abs(sums.grade - middle) / deviation)
        rank = math.ceil(errors.coverage * (len(off) + 1))
        widths = float(off[min(rank, len(off)) - 1])
    return Gym(sums.centre, line, covariance, errors, widths, len(known))


def leave_one_out(known: Sequence[Known], errors: Errors) -> tuple[Range, ...]:
    """Return the range of each of these climbs, calibrated by all others."""
    widths = calibrate(known, errors).widths
    middle, deviation = _GradeSums.of(known, errors).leave_one_out()
    spans = (range_of(float(m), widths * float(d)) for m, d in zip(middle, deviation, strict=True))
    return tuple(Range(*span, errors.coverage, len(known) - 1) for span in spans)


@dataclass(frozen=True)
class _GradeSums:
    """(N,) graded climbs: difficulties from the centre, grades, weights; and the model's spread."""

    centre: float
    difficulty: Floats
    grade: Floats
    weight: Floats
    spread: float

    @classmethod
    def of(cls, known: Sequence[Known], errors: Errors) -> _GradeSums:
        difficulty = np.array([one.difficulty for one in known], float)
        centre = float(difficulty.mean()) if len(known) else _MIDDLE
        noise = errors.spread**2 + np.array([one.variance for one in known], float)
        grade = np.array([one.grade for one in known], float)
        return cls(centre, difficulty - centre, grade, 1 / noise, errors.spread)

    def line(self) -> tuple[Floats, Floats]:
        """Return posterior mean and covariance of the grade at the centre and the slope."""
        precision, pull = self._sums()
        covariance = np.asarray(np.linalg.inv(precision), float)
        return covariance @ pull, covariance

    def leave_one_out(self) -> tuple[Floats, Floats]:
        """Return (N,) grade of each climb from the line without it, and its standard deviation."""
        at = np.stack([np.ones_like(self.difficulty), self.difficulty], axis=1)
        precision, pull = self._sums()
        own = self.weight[:, None] * at
        covariance = np.linalg.inv(precision - own[:, :, None] * at[:, None, :])
        rest = np.einsum("nij,nj->ni", covariance, pull - own * self.grade[:, None])
        variance = self.spread**2 + np.einsum("ni,nij,nj->n", at, covariance, at)
        return (at * rest).sum(axis=1), np.asarray(np.sqrt(variance), float)

    def _sums(self) -> tuple[Floats, Floats]:
        """Return precision and precision times mean, of the prior and all known grades."""
        at = np.stack([np.ones_like(self.difficulty), self.difficulty], axis=1)
        prior = np.diag([_OFFSET**-2, _SLOPE**-2])
        precision = prior + (self.weight[:, None] * at).T @ at
        pull = prior @ np.array([self.centre, 1.0]) + at.T @ (self.weight * self.grade)
        return precision, pull
