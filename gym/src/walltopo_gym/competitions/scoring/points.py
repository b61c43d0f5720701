"""Points a problem: most for a flash, fewer for a top, fewest for the zone; the best n count."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction

from walltopo_gym.competitions.scoring.score import Score, Tried, best_of, score_of, sums_of


def score_points(tried: Collection[Tried], worth: dict[str, int], best: int | None) -> Score:
    """Points; equal points: more tops, then more flashes.

    Parameters
    ----------
    worth : {flash, top, zone} of a problem that has none of its own; they are not added up.
    """
    sums = sums_of(tried)
    each = (_worth(one, worth) for one in tried)
    return score_of(sums, best_of(each, best), sums.more("tops"), sums.more("flashes"))


def _worth(one: Tried, worth: dict[str, int]) -> Fraction:
    of = one.points or worth
    if one.mark.top == 1:
        return Fraction(of["flash"])
    if one.mark.top:
        return Fraction(of["top"])
    return Fraction(of["zone"] if one.mark.zone else 0)
