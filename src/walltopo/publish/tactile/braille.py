"""Uncontracted Braille of letters and digits, as places of dots.

Dots of a cell: 1, 2, 3 down the left, 4, 5, 6 down the right. Sizes are those of medical labels and
signs (ISO 17049:2013).
"""

from __future__ import annotations

import unicodedata
from typing import Final

import numpy as np
from numpy.typing import NDArray

DOT_M: Final = 0.0015  # diameter of a dot
RAISED_M: Final = 0.0006  # height of a dot
DOT_APART_M: Final = 0.0025  # between dots of a cell
CELL_APART_M: Final = 0.0061  # between cells

_LETTERS: Final = {
    "a": "1", "b": "12", "c": "14", "d": "145", "e": "15", "f": "124", "g": "1245", "h": "125",
    "i": "24", "j": "245", "k": "13", "l": "123", "m": "134", "n": "1345", "o": "135", "p": "1234",
    "q": "12345", "r": "1235", "s": "234", "t": "2345", "u": "136", "v": "1236", "w": "2456",
    "x": "1346", "y": "13456", "z": "1356", "-": "36", "+": "235", ".": "256", ",": "2", "'": "3",
}  # fmt: skip
_DIGITS: Final = "jabcdefghi"  # 0 to 9, after the sign of numbers
_NUMBER: Final = "3456"
_NO_NUMBER: Final = "56"  # before a letter from a to j that follows digits


def braille_cells(text: str) -> list[str]:
    """Return the dots of each cell, "" for a space; characters without a cell are left out.

    Accents are dropped, capitals are written small.
    """
    plain = unicodedata.normalize("NFKD", text.casefold())
    cells: list[str] = []
    in_number = False
    for character in plain:
        if character.isascii() and character.isdigit():
            cells += [] if in_number else [_NUMBER]
            cells.append(_LETTERS[_DIGITS[int(character)]])
            in_number = True
        elif character.isspace():
            cells.append("")
            in_number = False
        elif character in _LETTERS:
            cells += [_NO_NUMBER] if in_number and character in _DIGITS else []
            cells.append(_LETTERS[character])
            in_number = False
    return cells


def braille_dots(text: str) -> NDArray[np.float64]:
    """Return the (n, 2) places of the dots: m to the right and down from the first cell's dot 1."""
    places = [
        (
            cell * CELL_APART_M + (dot > 3) * DOT_APART_M,
            ((dot - 1) % 3) * DOT_APART_M,
        )
        for cell, dots in enumerate(braille_cells(text))
        for dot in map(int, dots)
    ]
    return np.array(places, dtype=np.float64).reshape(-1, 2)


def braille_width(text: str) -> float:
    """Return the width of a line, m."""
    return len(braille_cells(text)) * CELL_APART_M
