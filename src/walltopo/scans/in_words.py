"""How a wall is put into words: the same in the terminal, the report and the page.

The page's own rules are in `viewer/src/steepness.ts` and `viewer/src/words.ts`; a test of the
viewer holds them against these.
"""

from __future__ import annotations

from collections.abc import Collection

from walltopo.scans.holds import HoldRow

__all__ = ["VERTICAL_DEG", "count_words", "steepness_words"]

VERTICAL_DEG = 5  # whole degrees from upright that still are vertical


def steepness_words(degrees: float) -> str:
    """`vertical`, `12° overhang`, `8° slab`; positive degrees lean towards the climber."""
    whole = round(abs(degrees))
    if whole <= VERTICAL_DEG:
        return "vertical"
    return f"{whole}° {'overhang' if degrees > 0 else 'slab'}"


def _counted(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def count_words(routes: int, holds: Collection[HoldRow]) -> str:
    """`4 routes, 31 holds, 2 volumes`: a volume is no hold; without volumes they are not told."""
    volumes = sum(hold.kind == "volume" for hold in holds)
    parts = [_counted(routes, "route"), _counted(len(holds) - volumes, "hold")]
    if volumes:
        parts.append(_counted(volumes, "volume"))
    return ", ".join(parts)
