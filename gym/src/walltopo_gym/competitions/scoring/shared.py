"""Points that those share who climbed a problem: the fewer they are, the more each gets."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from uuid import UUID

from walltopo_gym.competitions.scoring.score import Score, Tried, best_of, score_of, sums_of


def score_shared(
    tried: Collection[Tried], worth: dict[str, int], best: int | None,
    tops: Mapping[UUID, int], zones: Mapping[UUID, int],
) -> Score:  # fmt: skip
    """Points; equal points: more tops, then more flashes.

    Parameters
    ----------
    worth : {top, zone} of a problem that has none of its own, to be shared.
    tops, zones : how many of the category have it, by problem; a top has the zone, too.
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
