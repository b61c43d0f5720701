"""The Fontainebleau scale of boulders: parse and format grades."""

from __future__ import annotations

import math
import re

FONT = (
    *("3", "4", "4+", "5", "5+", "6A", "6A+", "6B", "6B+", "6C", "6C+"),
    *("7A", "7A+", "7B", "7B+", "7C", "7C+", "8A", "8A+", "8B", "8B+", "8C", "8C+", "9A"),
)
# The usual conversion table: V grade of each Font grade from 3 on.
V_OF = (0, 0, 0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 7, 8, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17)
_V = re.compile(r"V\s*(B|\d{1,2})", re.IGNORECASE)
_FONT = re.compile(r"(?:font|fb)?\s*([3-9])\s*([ABC])?\s*(\+)?", re.IGNORECASE)


def parse_grade(text: str) -> float | None:
    """Return a grade's index into `FONT` (halves between two), or None if it is no boulder grade.

    Accepts Font grades in any spelling (6a+, fb 6A+, 5), V grades, and ranges such as "6A-6B".
    """
    parts = [part for part in re.split(r"\s*(?:-|–|/|to)\s*", text.strip()) if part]
    indices = [_parse_label(part) for part in parts]
    known = [index for index in indices if index is not None]
    if not known or len(known) != len(indices) or len(known) > 2:
        return None
    return sum(known) / len(known)


def font_label(text: str) -> str | None:
    """Return a single Font grade as the scale spells it ("fb 6a+" is 6A+); None for other text.

    The grades are those of `FONT`, and 3A to 5C+ of gyms that divide the easy ones by letters.
    """
    name = _font_name(text)
    return name if name is not None and (name in FONT or name[0] in "345") else None


def v_label(text: str) -> str | None:
    """Return a single V grade as the scale spells it ("v 4" is V4); None for other text."""
    found = _V.fullmatch(text)
    name = "" if found is None else f"V{found[1].upper()}"
    return name if grade_ends(name) is not None else None


def grade_ends(label: str) -> tuple[int, int] | None:
    """Return the first and last index into `FONT` of a Font or V grade in its usual spelling.

    Slash grades (6A+/6B, V4-5) cover both grades. Return None if the label is neither.
    """
    first, slash, last = label.replace("-", "/").partition("/")
    if slash:
        prefix = "V" if first[:1] == "V" and last.isdecimal() else ""
        ends = grade_ends(first), grade_ends(prefix + last)
        return None if ends[0] is None or ends[1] is None else (ends[0][0], ends[1][1])
    if label in FONT:
        return FONT.index(label), FONT.index(label)
    if font_label(label) == label:
        index = parse_grade(label)
        return None if index is None else (math.floor(index), math.ceil(index))
    number = "0" if label.upper() == "VB" else label[1:]
    if label[:1].upper() != "V" or not number.isdecimal():
        return None
    indices = [k for k, value in enumerate(V_OF) if value == int(number)]
    return (indices[0], indices[-1]) if indices else None


def _font_name(text: str) -> str | None:
    found = _FONT.fullmatch(text)
    return found and f"{found[1]}{(found[2] or '').upper()}{found[3] or ''}"


def _parse_label(text: str) -> float | None:
    v = _V.fullmatch(text)
    if v:
        ends = grade_ends(f"V{v[1]}")
        return None if ends is None else sum(ends) / 2
    name = _font_name(text)
    if name is None:
        return None
    digit, letter = name[0], name[1:].rstrip("+")
    if name in FONT:
        return float(FONT.index(name))
    # 5A, 5B, 5C of some gyms are 5 and 5+ on the scale.
    if digit in "345":
        low = FONT.index(digit)
        return min(low + "ABC".index(letter or "B") / 2, FONT.index("6A") - 0.5)
    # "6" alone and "7+" mean the middle of the grades with that digit.
    return float(FONT.index(f"{digit}B")) if f"{digit}B" in FONT and not letter else None


def span_words(low: int, high: int) -> str:
    """Return a range as people read it: "6B", "6B to 7A"."""
    return FONT[low] if low == high else f"{FONT[low]} to {FONT[high]}"
