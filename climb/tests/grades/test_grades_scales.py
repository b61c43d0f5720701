"""Grades of four scales, as people write them."""

from __future__ import annotations

import itertools

import pytest

from walltopo_climb.grades.font import grade_ends
from walltopo_climb.grades.scales import SCALES, french_difficulty


@pytest.mark.parametrize(
    ("scale", "text", "label"),
    [
        ("font", "6a", "6A"),
        ("font", "fb 6A+", "6A+"),
        ("font", "6a+ / 6b", "6A+/6B"),
        ("font", "6A+-6B", "6A+/6B"),
        ("font", "5a", "5A"),
        ("font", "5C", "5C"),
        ("font", "5", "5"),
        ("font", "6", None),
        ("font", "6A-", None),
        ("font", "6B/6A", None),
        ("font", "6A/6A", None),
        ("font", "V4", None),
        ("font", "", None),
        ("font", "6A/6B/6C", None),
        ("font", "9B", None),
        ("v", "v4", "V4"),
        ("v", "vb", "VB"),
        ("v", "V4-5", "V4-5"),
        ("v", "V4/V5", "V4-5"),
        ("v", "VB-0", "VB-0"),
        ("v", "V18", None),
        ("v", "4", None),
        ("v", "V5-4", None),
        ("french", "6A+", "6a+"),
        ("french", "6a+/6b", "6a+/6b"),
        ("french", "5", "5"),
        ("french", "F7c", "7c"),
        ("french", "6", None),
        ("french", "VI", None),
        ("uiaa", "vi+", "VI+"),
        ("uiaa", "6+", "6+"),
        ("uiaa", "VII\u2212", "VII-"),
        ("uiaa", "VI+/VII-", "VI+/VII-"),
        ("uiaa", "IIII", None),
        ("uiaa", "6a", None),
        ("uiaa", "13", None),
    ],
)
def test_a_grade_is_spelled_as_its_scale_does(scale: str, text: str, label: str | None) -> None:
    found = SCALES[scale].read(text)
    assert (None if found is None else found.label) == label


@pytest.mark.parametrize("scale", SCALES)
def test_the_usual_grades_read_as_themselves_and_get_harder(scale: str) -> None:
    found = [SCALES[scale].read(label) for label in SCALES[scale].labels]
    assert [one and one.label for one in found] == list(SCALES[scale].labels)
    difficulties = [one.difficulty for one in found if one is not None]
    assert all(low < high for low, high in itertools.pairwise(difficulties))


def test_roman_and_arabic_grades_of_uiaa_are_the_same() -> None:
    roman, arabic = SCALES["uiaa"].read("VI+/VII-"), SCALES["uiaa"].read("6+/7-")
    assert roman is not None
    assert arabic is not None
    assert (roman.key, roman.difficulty) == (arabic.key, arabic.difficulty)


@pytest.mark.parametrize(
    ("uiaa", "french"),
    [("V+", "5b"), ("VI+", "6a"), ("VII+", "6b+"), ("VIII", "7a"), ("XI+", "9a")],
)
def test_uiaa_grades_lie_beside_french_ones(uiaa: str, french: str) -> None:
    one, other = SCALES["uiaa"].read(uiaa), SCALES["french"].read(french)
    assert one is not None
    assert other is not None
    assert abs(french_difficulty("uiaa", one.difficulty) - other.difficulty) <= 1


@pytest.mark.parametrize(
    ("label", "ends"),
    [
        ("6A+/6B", (6, 7)),
        ("5A", (3, 3)),
        ("5B", (3, 4)),
        ("5C", (4, 4)),
        ("V4-5", (7, 10)),
        ("VB-0", (0, 2)),
        ("6A/", None),
        ("6A/Blue", None),
    ],
)
def test_slash_grades_mean_the_places_of_both(label: str, ends: tuple[int, int] | None) -> None:
    assert grade_ends(label) == ends
