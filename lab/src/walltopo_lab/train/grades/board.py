"""Conversion of MoonBoard problems to climbs.

The board has columns A to K and rows 1 to 18, 0.20 m apart, at 40 degrees. Below is a vertical
board of 0.37 m with footholds. A problem lists its holds. Hands may start on those of rows 1 to 6,
and row 18 is the top. The data has no hold quality; `quality` estimates it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

from walltopo.core import InputError
from walltopo.core.text_files import read_utf8
from walltopo_climb.grades.font import FONT
from walltopo_climb.movement.grips import NEUTRAL, Grips, foot_share
from walltopo_climb.movement.sequence import Climb

SETUPS = ("2016", "2017")
CELLS = 11 * 18
_ANGLE = np.radians(40)
_KICK = 0.37  # m, the height of the vertical board below
_FOOTHOLDS = np.array([[0.2 * x, 0.0, 0.2] for x in (1, 3, 5, 7, 9)])
_CELL = re.compile(r"([A-K])(1[0-8]|[1-9])")


@dataclass(frozen=True)
class Problem:
    """A problem: its index in `FONT`, stars, and cells (column * 18 + row - 1), each once."""

    grade: int
    stars: int
    cells: tuple[int, ...]


def read_problems(path: Path) -> tuple[Problem, ...]:
    """Read a setup's problems from JSON: [[grade, stars, "G2 J7 ..."], ...]."""
    try:
        rows = msgspec.json.decode(read_utf8(path), type=list[tuple[str, int, str]])
        return tuple(Problem(FONT.index(g), s, cells_of(text)) for g, s, text in rows)
    except (msgspec.DecodeError, ValueError) as error:
        raise InputError(f"{path}: {error}") from error


def cells_of(text: str) -> tuple[int, ...]:
    """Return the cells of "G2 J7 ..."."""
    cells = []
    for name in text.upper().split():
        match = _CELL.fullmatch(name)
        if match is None:
            raise ValueError(f"{name!r} is not a hold of the board")
        cells.append((ord(match[1]) - ord("A")) * 18 + int(match[2]) - 1)
    return tuple(dict.fromkeys(cells))


def as_climb(problem: Problem, quality: npt.NDArray[np.float64] | None = None) -> Climb:
    """Return the problem as a climb; `quality`: (CELLS,) of each hold, None if unknown."""
    cells = np.array(problem.cells)
    n, extra = len(cells), len(_FOOTHOLDS)
    column, row = np.divmod(cells, 18)
    along = 0.2 * row + 0.1
    sine, cosine = np.sin(_ANGLE), np.cos(_ANGLE)
    board = np.stack([0.2 * column, -along * sine, _KICK + along * cosine], axis=1)
    wall = np.repeat([[0.0, -cosine, -sine], [0.0, -1.0, 0.0]], [n, extra], axis=0)
    pull = np.repeat([[0.0, sine, -cosine], [0.0, 0.0, -1.0]], [n, extra], axis=0)
    hand = np.full(n, NEUTRAL.quality) if quality is None else quality[cells]
    grips = Grips(
        position=np.concatenate([board, _FOOTHOLDS]),
        wall=wall,
        pull=pull,
        hand=np.concatenate([hand, np.zeros(extra)]),
        outward=np.full(n + extra, NEUTRAL.outward),
        foot=foot_share(np.repeat([40.0, 0.0], [n, extra])),
    )
    start = tuple(int(i) for i in np.flatnonzero(row < 6))
    return Climb(grips, start, tuple(int(i) for i in np.flatnonzero(row == 17)))
