"""The scoring formulas of boulders: IFSC 2018 and 2025, most tops, points, shared points.

IFSC (now World Climbing) since 2025: 25 points a top, 10 for the zone without a top, and 0.1 less
for each try before it. Until 2024: more tops, more zones, fewer tries to the tops, fewer tries to
the zones. Ties are broken by the rounds before (countback), in ranking.py. The sources are named in
docs/competitions.md.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from typing import Final
from uuid import UUID

from walltopo_gym.competitions.scoring.score import (
    AttemptedProblem,
    Mark,
    Score,
    best_of,
    score_of,
    sums_of,
)

_TOP: Final = Fraction(25)

_ZONE: Final = Fraction(10)

_TRY: Final = Fraction(1, 10)


def score_2025(tried: Collection[AttemptedProblem]) -> Score:
    """Return the score of 2025: points alone."""
    return score_of(sums_of(tried), sum((_points(one.mark) for one in tried), Fraction(0)))


def score_2018(tried: Collection[AttemptedProblem]) -> Score:
    """Return the score of 2018: tops, zones, tries to tops, tries to zones."""
    sums = sums_of(tried)
    return score_of(
        sums,
        None,
        sums.more("tops"),
        sums.more("zones"),
        sums.fewer("tries-to-top"),
        sums.fewer("tries-to-zone"),
    )


def _points(mark: Mark) -> Fraction:
    first, worth = (mark.top, _TOP) if mark.top else (mark.zone, _ZONE)
    # However many tries it took, nobody is worse off for it.
    return max(Fraction(0), worth - _TRY * (first - 1)) if first else Fraction(0)


def score_most_tops(tried: Collection[AttemptedProblem]) -> Score:
    """Return the score of most tops; ties by more flashes, then fewer tries to the tops."""
    sums = sums_of(tried)
    return score_of(sums, Fraction(sums.tops), sums.more("flashes"), sums.fewer("tries-to-top"))


def score_points(
    tried: Collection[AttemptedProblem], worth: dict[str, int], best: int | None
) -> Score:
    """Return the score by points; ties by more tops, then more flashes.

    Parameters
    ----------
    worth : default {flash, top, zone} of a problem; the three are not added up.
    """
    sums = sums_of(tried)
    each = (_worth(one, worth) for one in tried)
    return score_of(sums, best_of(each, best), sums.more("tops"), sums.more("flashes"))


def _worth(one: AttemptedProblem, worth: dict[str, int]) -> Fraction:
    of = one.points or worth
    if one.mark.top == 1:
        return Fraction(of["flash"])
    if one.mark.top:
        return Fraction(of["top"])
    return Fraction(of["zone"] if one.mark.zone else 0)


def score_shared(
    tried: Collection[AttemptedProblem],
    worth: dict[str, int],
    best: int | None,
    tops: Mapping[UUID, int],
    zones: Mapping[UUID, int],
) -> Score:
    """Return the score by shared points; ties by more tops, then more flashes.

    Parameters
    ----------
    worth : default {top, zone} of a problem, to be shared.
    tops, zones : number of competitors of the category who have it, by problem; a top includes the
        zone.
    """
    sums = sums_of(tried)
    each = (
        (Fraction((one.points or worth)["top"], tops[one.problem]) if one.mark.top else Fraction(0))
        + (
            Fraction((one.points or worth)["zone"], zones[one.problem])
            if one.mark.zone
            else Fraction(0)
        )
        for one in tried
    )
    return score_of(sums, best_of(each, best), sums.more("tops"), sums.more("flashes"))
