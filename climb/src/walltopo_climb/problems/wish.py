"""What a setter wishes for."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from walltopo.core import InputError
from walltopo_climb.grades.font import FONT, parse_grade
from walltopo_climb.movement.body import ADULT, Body

Steepness = Literal["any", "slab", "vertical", "overhang", "steep"]
Reach = Literal["any", "static", "dynamic"]
HoldKind = Literal["any", "jugs", "crimps", "slopers", "pinches", "pockets", "small", "large"]

# Degrees from and to, of the wall under the holds, as the page's words for walls have them.
STEEPNESS_DEG: dict[Steepness, tuple[float, float]] = {
    "slab": (-90.0, -5.0),
    "vertical": (-5.0, 5.0),
    "overhang": (5.0, 90.0),
    "steep": (35.0, 90.0),
}
# Types of holds; of "small" and "large" the size decides.
HOLD_KINDS: dict[HoldKind, frozenset[str]] = {
    "jugs": frozenset({"jug", "rail"}),
    "crimps": frozenset({"crimp", "edge"}),
    "slopers": frozenset({"sloper"}),
    "pinches": frozenset({"pinch"}),
    "pockets": frozenset({"pocket"}),
}

Grade = Annotated[str, msgspec.Meta(max_length=20)]


class Wish(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The problem that is wished for.

    Parameters
    ----------
    grade : a grade or a range, such as "6B" or "6B-6C"; of Font or V.
    moves : of hands, from the start to both hands on the top.
    steepness, reach, holds : style. "static": every hold is in reach; "dynamic": one has to leap.
    height, span : metres, of a body that must get up it, too; span 0: as the height.
        `height_m` and `span_m` in JSON.
    count : of proposals. seed : another one gives others.

    Raises
    ------
    InputError : from `ends` and `body`, where grade or body are none.
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
        """Who must get up it."""
        return Body(self.height, self.span)

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest grade, as places in `FONT`."""
        parts = self.grade.replace("–", "-").split("-")
        places = [parse_grade(part) for part in parts]
        known = [place for place in places if place is not None]
        if len(known) != len(parts) or len(known) > 2:
            raise InputError(
                f"{self.grade!r} is no grade of boulders",
                f"Give one of {', '.join(FONT)}, a V grade, or two with a dash between.",
            )
        return min(known), max(known)
