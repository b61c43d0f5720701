"""The grade scale of a gym, computed from difficulties without the model itself."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from walltopo_climb.grades.calibrate import Gym, Known, calibrate, leave_one_out
from walltopo_climb.grades.model import Learnt, Range


@dataclass(frozen=True)
class GymScale:
    """The gym's scale, calibrated by its graded climbs; the board's scale without any.

    Parameters
    ----------
    learnt : of the model that gave all difficulties.
    """

    learnt: Learnt
    graded: tuple[Known, ...]

    @cached_property
    def _gyms(self) -> dict[bool, Gym]:
        return {known: calibrate(self.graded, self.learnt.errors(known)) for known in (False, True)}

    @cached_property
    def _others(self) -> dict[bool, tuple[Range, ...]]:
        return {k: leave_one_out(self.graded, self.learnt.errors(k)) for k in (False, True)}

    def grade(self, difficulty: float, known: bool) -> float:
        """Return the grade at a model's difficulty, as a fractional index into `FONT`."""
        return self._gyms[known].grade_at(difficulty)[0] if self.graded else difficulty

    def range(self, difficulty: float, known: bool) -> Range:
        """Return the range of grades around a model's difficulty."""
        return (
            self._gyms[known].range(difficulty)
            if self.graded
            else self.learnt.bounded(difficulty, known)
        )

    def range_by_others(self, number: int, known: bool) -> Range:
        """Return the range of graded climb `number`, calibrated by all others."""
        return self._others[known][number]
