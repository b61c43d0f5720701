"""Grades as people write them."""

from __future__ import annotations

import pytest

from walltopo_climb.grades.font import FONT, V_OF, grade_ends, parse_grade


@pytest.mark.parametrize(
    ("text", "index"),
    [
        *((name, float(k)) for k, name in enumerate(FONT)),
        ("6a+", 6.0),
        ("Font 7A", 11.0),
        ("fb 6c", 9.0),
        ("V4", 7.5),
        ("VB", 1.0),
        ("6A-6B", 6.0),
        ("6A to 6A+", 5.5),
        ("5a", 3.0),
        ("", None),
        ("hard", None),
        ("6D", None),
        ("V99", None),
        ("5.10a", None),
        ("6A-", 5.0),
    ],
)
def test_grades_are_read_in_any_spelling(text: str, index: float | None) -> None:
    assert parse_grade(text) == index


def test_grades_have_one_v_grade_each_and_never_fall() -> None:
    assert len(V_OF) == len(FONT)
    assert list(V_OF) == sorted(V_OF)


@pytest.mark.parametrize(
    ("label", "ends"),
    [
        ("6A", (5, 5)),
        ("V3", (5, 6)),
        ("VB", (0, 2)),
        ("V17", (23, 23)),
        ("6a", None),
        ("V18", None),
        ("Blue", None),
        ("V", None),
        ("", None),
    ],
)
def test_grades_say_which_places_they_mean(label: str, ends: tuple[int, int] | None) -> None:
    assert grade_ends(label) == ends
