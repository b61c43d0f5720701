"""Grade systems: the common scales, and what a gym may make of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from walltopo.core import InputError

FONT: Final = (
    "3", "4", "4+", "5", "5+", "6A", "6A+", "6B", "6B+", "6C", "6C+", "7A", "7A+", "7B", "7B+",
    "7C", "7C+", "8A", "8A+", "8B", "8B+", "8C", "8C+", "9A",
)  # fmt: skip
V_SCALE: Final = ("VB", *(f"V{number}" for number in range(18)))
KINDS: Final = ("font", "v", "circuits", "own")

_SCALES: Final = {"font": FONT, "v": V_SCALE}


def check_grades(
    kind: str, labels: Sequence[str], ranges: Sequence[tuple[str | None, str | None]]
) -> None:
    """Refuse grades that no climber would understand.

    Parameters
    ----------
    labels : from the easiest to the hardest; ranges : lowest and highest grade of each, both of
        one common scale, or None.

    Raises
    ------
    InputError : says which grade, and what is allowed.
    """
    if not labels:
        raise InputError("a grade system needs at least one grade")
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        raise InputError(f"the grade {twice[0]!r} is there twice")
    if kind in _SCALES:
        _check_order(kind, labels)
    for label, ends in zip(labels, ranges, strict=True):
        _check_range(label, *ends)


def _check_order(kind: str, labels: Sequence[str]) -> None:
    scale = _SCALES[kind]
    unknown = [label for label in labels if label not in scale]
    if unknown:
        raise InputError(f"{unknown[0]!r} is no grade of {kind}: {', '.join(scale)}")
    if sorted(labels, key=scale.index) != list(labels):
        raise InputError("the grades do not go from the easiest to the hardest")


def _check_range(label: str, low: str | None, high: str | None) -> None:
    if low is None and high is None:
        return
    scale = next((s for s in _SCALES.values() if low in s and high in s), None)
    if scale is None or low is None or high is None:
        raise InputError(f"{label}: {low} to {high} is no range of Font or of V grades")
    if scale.index(low) > scale.index(high):
        raise InputError(f"{label}: {low} is harder than {high}")
