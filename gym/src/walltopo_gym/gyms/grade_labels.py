"""Grades as people write them, and the labels of a gym's own systems."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from walltopo_climb.grades.scales import SCALES, Scale, ScaleGrade
from walltopo_gym.errors import RequestError
from walltopo_gym.texts import same_key


def own_label(kind: str, labels: Sequence[str], written: str) -> str | None:
    """Return the label of a grade system that a written grade means; None if there is none.

    On a common scale "6a" is 6A and "V4/V5" is V4-5; elsewhere upper and lower case are the same.
    """
    if written in labels:
        return written
    scale = SCALES.get(kind)
    grade = scale.read(written) if scale is not None else None
    if scale is not None and grade is not None:
        read = {label: scale.read(label) for label in labels}
        found = next((label for label, one in read.items() if one and one.key == grade.key), None)
        if found is not None:
            return found
    return next((label for label in labels if same_key(label) == same_key(written)), None)


def spelled_labels(kind: str, labels: Sequence[str]) -> list[str]:
    """Return the labels of a new grade system, on a common scale as the scale spells them.

    Raises
    ------
    RequestError : there is no label, one comes twice or is no grade of the scale, or the labels do
        not get harder.
    """
    if not labels:
        raise RequestError("grades-none")
    scale = SCALES.get(kind)
    grades = [
        ScaleGrade(label, 0, label) if scale is None else _read_label(kind, scale, label)
        for label in labels
    ]
    keys = Counter(grade.key for grade in grades)
    twice = sorted(grade.label for grade in grades if keys[grade.key] > 1)
    if twice:
        raise RequestError("grades-twice", grade=twice[0])
    if sorted(grades, key=lambda grade: grade.difficulty) != grades:
        raise RequestError("grades-order")
    return [grade.label for grade in grades]


def _read_label(kind: str, scale: Scale, label: str) -> ScaleGrade:
    grade = scale.read(label)
    if grade is None:
        usual = ", ".join(scale.labels)
        raise RequestError("grades-unknown", grade=label, kind=kind, scale=usual)
    return grade


def spelled_range(label: str, low: str | None, high: str | None) -> tuple[str | None, str | None]:
    """Return the range of a circuit as its scale spells it: Font or V.

    Raises
    ------
    RequestError : the two are no range of one scale.
    """
    if low is None and high is None:
        return None, None
    for scale in (SCALES["font"], SCALES["v"]):
        first, last = scale.read(low or ""), scale.read(high or "")
        if first is not None and last is not None:
            if first.difficulty > last.difficulty:
                raise RequestError("grades-range-order", label=label, low=low, high=high)
            return first.label, last.label
    raise RequestError("grades-range", label=label, low=low, high=high)
