"""The specification of the problems that a setter requests."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from walltopo.core import InputError
from walltopo_climb.grades.font import FONT, parse_grade
from walltopo_climb.movement.body import ADULT, Body

Steepness = Literal["any", "slab", "vertical", "overhang", "steep"]
Reach = Literal["any", "static", "dynamic"]
HoldKind = Literal["any", "jugs", "crimps", "slopers", "pinches", "pockets", "small", "large"]

# Range in degrees of the wall under the holds, as in the page's names of steepness.
STEEPNESS_DEG: dict[Steepness, tuple[float, float]] = {
    "slab": (-90.0, -5.0),
    "vertical": (-5.0, 5.0),
    "overhang": (5.0, 90.0),
    "steep": (35.0, 90.0),
}
# Types of holds; "small" and "large" depend on the size instead.
HOLD_KINDS: dict[HoldKind, frozenset[str]] = {
    "jugs": frozenset({"jug", "rail"}),
    "crimps": frozenset({"crimp", "edge"}),
    "slopers": frozenset({"sloper"}),
    "pinches": frozenset({"pinch"}),
    "pockets": frozenset({"pocket"}),
}

Grade = Annotated[str, msgspec.Meta(max_length=20)]


class ProblemSpec(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The requested properties of a new problem.

    Parameters
    ----------
    grade : a grade or a range, such as "6B" or "6B-6C", Font or V.
    moves : number of hand moves, from the start to both hands on the top.
    steepness, reach, holds : style. "static": every hold is in reach; "dynamic": with a leap.
    height, span : metres, of a body that must also be able to climb it; span 0: as the height.
        `height_m` and `span_m` in JSON.
    count : number of proposals. seed : random seed.

    Raises
    ------
    InputError : from `ends` and `body`, if the grade or the body is invalid.
    """

    grade: Grade
    moves: Annotated[int, msgspec.Meta(ge=2, le=16)] = 6
    steepness: Steepness = "any"
    reach: Reach = "any"
    holds: HoldKind = "any"
    height: Annotated[float, msgspec.Meta(ge=0.9, le=2.3)] = msgspec.field(
        name="height_m", default=ADULT.height
    )
    span: Annotated[float, msgspec.Meta(ge=0.0, le=2.8)] = msgspec.field(name="span_m", default=0.0)
    count: Annotated[int, msgspec.Meta(ge=1, le=8)] = 3
    seed: Annotated[int, msgspec.Meta(ge=0, lt=2**31)] = 0

    @property
    def body(self) -> Body:
        """Return the body that must be able to climb the problem."""
        return Body(self.height, self.span)

    @property
    def ends(self) -> tuple[float, float]:
        """Return the lowest and the highest grade, as indices into `FONT`."""
        parts = self.grade.replace("–", "-").split("-")
        indices = [parse_grade(part) for part in parts]
        known = [index for index in indices if index is not None]
        if len(known) != len(parts) or len(known) > 2:
            raise InputError(
                f"{self.grade!r} is not a boulder grade",
                f"Give one of {', '.join(FONT)}, a V grade, or two separated by a dash.",
            )
        return min(known), max(known)
