"""Grade scales: spell a grade as its scale does, and order it among the others.

Boulders have Font and V grades, routes on a rope French and UIAA grades.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from walltopo_climb.grades.font import FONT, font_label, parse_grade, v_label

V_SCALE: Final = ("VB", *(f"V{number}" for number in range(18)))
FRENCH: Final = (
    "3",
    "4a",
    "4b",
    "4c",
    "5a",
    "5b",
    "5c",
    *(f"{digit}{letter}{plus}" for digit in "6789" for letter in "abc" for plus in ("", "+")),
)[:-1]
_ROMAN: Final = ("I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI", "XII")
UIAA: Final = (
    *_ROMAN[:4],
    *(f"{number}{sign}" for number in _ROMAN[4:] for sign in ("-", "", "+")),
)

_FRENCH_GRADE: Final = re.compile(r"(?:f\.?|french)?\s*([1-9])([abc])?(\+)?", re.IGNORECASE)
_UIAA_GRADE: Final = re.compile(
    r"(?:uiaa)?\s*([IVX]{1,4}|[1-9]|1[0-2])\s*([-\u2212+])?", re.IGNORECASE
)
_LETTERED_FROM: Final = 6  # French grades below it may lack the letter
FRENCH_6A: Final = 36  # difficulty of 6a among the French grades
_UIAA_6_PLUS: Final = 19  # difficulty of VI+ among those of UIAA


class ScaleGrade(NamedTuple):
    """A grade of a scale.

    Parameters
    ----------
    label : as the scale spells it.
    difficulty : greater is harder; in steps of its own scale.
    key : the same for two spellings of one grade ("VI+" and "6+" of UIAA).
    """

    label: str
    difficulty: float
    key: str


@dataclass(frozen=True)
class Scale:
    """A scale of grades.

    Parameters
    ----------
    labels : the usual grades, from the easiest to the hardest.
    single : reads one grade; None if the text is not a grade of the scale.
    between : the characters that separate the two grades of a slash grade.
    joined : spells a slash grade by its two labels.
    """

    labels: tuple[str, ...]
    single: Callable[[str], ScaleGrade | None]
    between: re.Pattern[str]
    joined: Callable[[str, str], str]

    def read(self, text: str) -> ScaleGrade | None:
        """Return the grade that somebody wrote, or None if this scale does not have it.

        Slash grades, such as 6A+/6B, have two different grades, the easier one first.
        """
        parts = self.between.split(text.strip())
        if len(parts) == 1:
            return self.single(parts[0])
        if len(parts) != 2:
            return None
        low = self.single(parts[0])
        high = self.single(parts[1]) or self.single(f"{parts[0][:1]}{parts[1]}")
        if low is None or high is None or not low.difficulty < high.difficulty:
            return None
        label, key = self.joined(low.label, high.label), f"{low.key}/{high.key}"
        return ScaleGrade(label, (low.difficulty + high.difficulty) / 2, key)


def _read_font(text: str) -> ScaleGrade | None:
    label = font_label(text)
    difficulty = None if label is None else parse_grade(label)
    return None if label is None or difficulty is None else ScaleGrade(label, difficulty, label)


def _read_v(text: str) -> ScaleGrade | None:
    label = v_label(text)
    return None if label is None else ScaleGrade(label, V_SCALE.index(label), label)


def _read_french(text: str) -> ScaleGrade | None:
    found = _FRENCH_GRADE.fullmatch(text)
    if found is None or (not found[2] and int(found[1]) >= _LETTERED_FROM):
        return None
    digit, letter, plus = found[1], (found[2] or "").lower(), found[3] or ""
    label = f"{digit}{letter}{plus}"
    # A plus is worth half a letter, or as much as from a to b/c where there are no letters.
    steps = 2 * "abc".index(letter) + len(plus) if letter else 3 * len(plus)
    return ScaleGrade(label, 6 * int(digit) + steps, label)


def _read_uiaa(text: str) -> ScaleGrade | None:
    found = _UIAA_GRADE.fullmatch(text)
    if found is None:
        return None
    number, sign = found[1].upper(), (found[2] or "").replace("\u2212", "-")
    if not number.isdecimal() and number not in _ROMAN:
        return None
    roman = _ROMAN[int(number) - 1] if number.isdecimal() else number
    difficulty = 3 * (_ROMAN.index(roman) + 1) + {"-": -1, "": 0, "+": 1}[sign]
    return ScaleGrade(f"{number}{sign}", difficulty, f"{roman}{sign}")


_SLASHED: Final = re.compile(r"\s*(?:/|-|\u2013|\bto\b)\s*")
# A minus belongs to the grade.
_UIAA_SLASHED: Final = re.compile(r"\s*/\s*")

SCALES: Final[Mapping[str, Scale]] = {
    "font": Scale(FONT, _read_font, _SLASHED, "{}/{}".format),
    "v": Scale(V_SCALE, _read_v, _SLASHED, lambda low, high: f"{low}-{high[1:]}"),
    "french": Scale(FRENCH, _read_french, _SLASHED, "{}/{}".format),
    "uiaa": Scale(UIAA, _read_uiaa, _UIAA_SLASHED, "{}/{}".format),
}


def french_difficulty(scale: str, difficulty: float) -> float:
    """Return a difficulty of the French or UIAA scale on the French one.

    UIAA VI+ is 6a, VIII 7a, X 8a to 8a+ and XI+ 9a (the usual tables within half a letter).
    """
    return FRENCH_6A + 1.2 * (difficulty - _UIAA_6_PLUS) if scale == "uiaa" else difficulty
