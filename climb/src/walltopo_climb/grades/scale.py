"""The scale of a gym, for whoever has places and no model at hand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from walltopo_climb.grades.calibrate import Gym, Known, calibrate, left_out
from walltopo_climb.grades.model import Learnt, Range


@dataclass(frozen=True)
class GymScale:
    """The gym's scale as its graded climbs tell it, the board's without any.

    Parameters
    ----------
    learnt : of the model that all places are of.
    """

    learnt: Learnt
    told: tuple[Known, ...]

    @cached_property
    def _gyms(self) -> dict[bool, Gym]:
        return {known: calibrate(self.told, self.learnt.errors(known)) for known in (False, True)}

    @cached_property
    def _others(self) -> dict[bool, tuple[Range, ...]]:
        return {known: left_out(self.told, self.learnt.errors(known)) for known in (False, True)}

    def grade(self, place: float, known: bool) -> float:
        """A place in `FONT` of the model's place, and a fraction."""
        return self._gyms[known].place(place)[0] if self.told else place

    def range(self, place: float, known: bool) -> Range:
        """The range of grades around it."""
        return self._gyms[known].range(place) if self.told else self.learnt.bounded(place, known)

    def range_by_others(self, number: int, known: bool) -> Range:
        """The range of a climb that is told, as the others say; `number`: its place in `told`."""
        return self._others[known][number]
