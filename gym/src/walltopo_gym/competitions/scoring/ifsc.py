"""Boulder scoring of the international federation (IFSC, now World Climbing), by year.

Since 2025: 25 points a top, 10 for the zone where there is no top, and 0.1 less for each try before
it. Until 2024: more tops, more zones, fewer tries to the tops, fewer tries to the zones.
Ties are broken by the rounds before (countback), which is the board's (ranking.py).
The sources are named in docs/gym.md.
"""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction
from typing import Final

from walltopo_gym.competitions.scoring.score import Mark, Score, Tried, score_of, sums_of

_TOP: Final = Fraction(25)
_ZONE: Final = Fraction(10)
_TRY: Final = Fraction(1, 10)


def score_2025(tried: Collection[Tried]) -> Score:
    """Points, and nothing else."""
    return score_of(sums_of(tried), sum((_points(one.mark) for one in tried), Fraction(0)))


def score_2018(tried: Collection[Tried]) -> Score:
    """Tops, zones, tries to tops, tries to zones."""
    sums = sums_of(tried)
    return score_of(sums, None, sums.more("tops"), sums.more("zones"), sums.fewer("tries-to-top"),
                    sums.fewer("tries-to-zone"))  # fmt: skip


def _points(mark: Mark) -> Fraction:
    first, worth = (mark.top, _TOP) if mark.top else (mark.zone, _ZONE)
    # However many tries it took, nobody is worse off for it.
    return max(Fraction(0), worth - _TRY * (first - 1)) if first else Fraction(0)
