"""Points of a route, and the grade that climbers vote for.

A top is worth 100 points, plus 20 for each step of its grade above 3 on the Font scale; a flash is
worth half a step more, an onsight a step. V grades count as the Font grade beside them; French
grades, and the French ones beside UIAA grades, as the Font grade of the same digits; a circuit as
the middle of its range. A gym's own labels without a range are spread evenly from 4 to 7C. A route
without a grade counts as a 3.

A standing is the sum of a climber's best `BEST` routes of a period, each route once: a weekly
visitor finds that many, and a daily visitor gains by climbing harder, not more.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.scales import FRENCH_6A, SCALES, V_SCALE, french_difficulty
from walltopo_gym.climbing.kinds import Kind

BEST: Final = 10

FLASH: Final = 10
ONSIGHT: Final = 20

_BASE: Final = 100

_STEP: Final = 20

# The Font grade beside each V grade, as in guidebooks, up to 9A.
_OF_V: Final = [
    FONT.index(grade)
    for _, grade in zip(
        V_SCALE,
        (
            "3",
            "4",
            "5",
            "5+",
            "6A",
            "6B",
            "6C",
            "7A",
            "7A+",
            "7B",
            "7C",
            "7C+",
            "8A",
            "8A+",
            "8B",
            "8B+",
            "8C",
            "8C+",
            "9A",
        ),
        strict=True,
    )
]

_OWN_FROM, _OWN_TO = FONT.index("4"), FONT.index("7C")


def worth_of(kind: str, grades: Sequence[Mapping[str, Any]], label: str) -> int:
    """Return the points of a top.

    Parameters
    ----------
    kind : of the route's grade system; empty without a system.
    grades : of the system, from the easiest; empty without a system.
    label : of the route's grade.
    """
    return _BASE + round(_STEP * _font_steps(kind, grades, label))


def bonus_of(kind: str) -> int:
    """Return the points of an ascent beyond those of a top."""
    return {Kind.ONSIGHT: ONSIGHT, Kind.FLASH: FLASH}.get(Kind(kind), 0)


def best_of(values: Iterable[int]) -> int:
    """Return the points of a standing.

    Parameters
    ----------
    values : of each route that was topped, its flash included.
    """
    return sum(sorted(values, reverse=True)[:BEST])


def _font_steps(kind: str, grades: Sequence[Mapping[str, Any]], label: str) -> float:
    """Return the number of Font steps above 3."""
    labels = [grade["label"] for grade in grades]
    if label in labels:
        index = labels.index(label)
        ends = [_on_scale("", grades[index].get(name) or "") for name in ("low", "high")]
        if ends[0] is not None and ends[1] is not None:
            return (ends[0] + ends[1]) / 2
    known = _on_scale(kind, label)
    if known is not None:
        return known
    if label not in labels:
        return 0.0
    if len(labels) == 1:
        return (_OWN_FROM + _OWN_TO) / 2
    return _OWN_FROM + (_OWN_TO - _OWN_FROM) * index / (len(labels) - 1)


def _on_scale(kind: str, label: str) -> float | None:
    """Return the Font steps of a grade of a common scale; without a scale, of Font or V."""
    for name in (kind,) if kind in SCALES else ("font", "v"):
        grade = SCALES[name].read(label)
        if grade is None or grade.label != label:
            continue
        if name == "font":
            return grade.difficulty
        if name == "v":
            return float(np.interp(grade.difficulty, range(len(_OF_V)), _OF_V))
        return max(0.0, french_difficulty(name, grade.difficulty) - FRENCH_6A + FONT.index("6A"))
    return None


# With fewer votes, one person's opinion would pass for everybody's.
ENOUGH: Final = 3


def crowd_grade(votes: Mapping[str, int], labels: Sequence[str]) -> str:
    """Return the median vote, the easier of two; empty with fewer than `ENOUGH` votes.

    Parameters
    ----------
    votes : label to number; labels : of the route's grade system, from the easiest to the hardest.
        Votes for removed labels do not count.
    """
    counted = [(label, votes[label]) for label in labels if votes.get(label)]
    whole = sum(number for _, number in counted)
    if whole < ENOUGH:
        return ""
    below = 0
    for label, number in counted:
        below += number
        if 2 * below >= whole:
            return label
    raise AssertionError("the last vote is at the end")
