"""Attempts that no clip showed, for tests of what follows the reading."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from walltopo.scans.attempt import AttemptFile, FilmedMove

_LIMBS = ("left hand", "right hand", "left foot", "right foot")


def an_attempt(moves: Sequence[tuple[str, int]] = (("left hand", 1),), *, top: bool = True) -> Any:
    """Return the plain values of an attempt with these moves, a second apart."""
    rows = [
        FilmedMove(
            limb=limb,  # type: ignore[arg-type]
            holds=tuple(hold if each == limb else 0 for each in _LIMBS),  # type: ignore[arg-type]
            hip=(0.0, 0.0, 1.0),
            effort=0.0,
            came_from=0,
            time=float(number),
            duration=1.0,
            confidence=0.9,
        )
        for number, (limb, hold) in enumerate(moves)
    ]
    end = float(len(rows))
    made = AttemptFile(
        clip="",
        length=end,
        route=1,
        foreign=0.0,
        start=0.0,
        top=end if top else None,
        fall=None if top else end,
        highest=1,
        moves=tuple(rows),
        rests=(),
        contacts=(),
    )
    return msgspec.to_builtins(made, str_keys=True)
