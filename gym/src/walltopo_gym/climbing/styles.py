"""The style of a route: steepness, length, main hold type."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

# Kinds of walls, and below how many degrees of overhang one still is of that kind.
STEEPNESS: Final = {"slab": -5.0, "vertical": 5.0, "slight": 20.0, "steep": 45.0, "roof": 181.0}
# Up to how many holds a route is that long; in numbers of holds, for not every scan has a scale.
LENGTHS: Final = {"short": 6, "middle": 10, "long": 10_000}


def steepness_of(degrees: float | None) -> str:
    """Return the kind of wall, of `STEEPNESS`; empty for an unknown angle."""
    if degrees is None:
        return ""
    return next(kind for kind, below in STEEPNESS.items() if degrees < below)


def main_hold(types: Mapping[str, int]) -> str:
    """Return the commonest hold type of a route, the first by name if tied; empty for none."""
    return max(sorted(types), key=lambda name: types[name]) if types else ""


def length_of(holds: int) -> str:
    """Return the kind of length, of `LENGTHS`, for a number of holds; empty for an unknown one."""
    return next(kind for kind, most in LENGTHS.items() if holds <= most) if holds else ""
