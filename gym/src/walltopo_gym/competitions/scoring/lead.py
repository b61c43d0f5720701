"""The scoring formulas of rope climbing: IFSC lead, and the sum of the holds reached.

IFSC lead: the higher high point ranks first, and a top before each hold. In a round of several
routes, competitors with equal high points on a route share the average of their ranks there, and
the geometric mean of a competitor's ranks is the result. Ties are broken by the rounds before
(countback, in ranking.py), in a final then by the shorter climbing time.

The rule book (Competition Rules of March 2025) was not at hand. docs/competitions.md names the
secondary descriptions of 2018 to 2024; the geometric mean follows the authors' knowledge of the
rules.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import replace
from fractions import Fraction
from math import prod
from statistics import geometric_mean
from typing import Final, TypeVar
from uuid import UUID

from walltopo_gym.competitions.scoring.score import (
    AttemptedProblem,
    Criterion,
    Score,
    best_of,
    format_points,
    format_time,
    score_of,
    sums_of,
)

Who = TypeVar("Who")

_NO_TIME: Final = Fraction(-1_000_000)  # seconds; longer than each climbing time


def average_ranks(heights: Mapping[Who, int]) -> dict[Who, Fraction]:
    """Return ranks by height, the greatest first; equal heights share the average of their
    ranks."""
    rank_of: dict[int, Fraction] = {}
    before = 0
    for height, number in sorted(Counter(heights.values()).items(), reverse=True):
        rank_of[height] = before + Fraction(number + 1, 2)
        before += number
    return {who: rank_of[height] for who, height in heights.items()}


def score_lead(
    tried: Collection[AttemptedProblem], ranks: Mapping[UUID, Fraction], routes: int
) -> Score:
    """Return the score of IFSC lead.

    Parameters
    ----------
    ranks : the competitor's rank on each route of the category, also on those not tried; empty for
        a competitor without a result.
    routes : number of routes of the category in the round.
    """
    first = _mean_rank(ranks) if routes > 1 else _high_point(tried)
    score = score_of(sums_of(tried), None, first)
    return replace(score, zones=0, result=first.shown, tie_breaks=(_climbing_time(tried),))


def _high_point(tried: Collection[AttemptedProblem]) -> Criterion:
    best = max((one.mark for one in tried), key=lambda mark: mark.height, default=None)
    if best is None:
        return Criterion("high", Fraction(0), "")
    return Criterion("high", Fraction(best.height), best.high)


def _mean_rank(ranks: Mapping[UUID, Fraction]) -> Criterion:
    """Return the geometric mean of ranks as a criterion.

    The product orders as the mean does and is exact, so its inverse is the value.
    """
    if not ranks:
        return Criterion("mean-rank", Fraction(0), "")
    mean = geometric_mean(map(float, ranks.values()))
    return Criterion("mean-rank", 1 / prod(ranks.values(), start=Fraction(1)), f"{mean:.2f}")


def _climbing_time(tried: Collection[AttemptedProblem]) -> Criterion:
    """Return the climbing time; a competitor without one ranks after those with one."""
    times = [one.mark.seconds for one in tried]
    known = [time for time in times if time is not None]
    if not known or len(known) < len(times):
        return Criterion("time", _NO_TIME, "")
    seconds = sum(known)
    return Criterion("time", Fraction(-seconds), format_time(seconds))


def score_lead_points(tried: Collection[AttemptedProblem], best: int | None) -> Score:
    """Return the score by holds reached; ties by more tops, then fewer tries to the high points."""
    sums = sums_of(tried)
    points = best_of((_holds_reached(one) for one in tried), best)
    score = score_of(sums, points, sums.more("tops"), sums.fewer("tries-to-high"))
    return replace(score, zones=0, result=format_points(points))


def _holds_reached(one: AttemptedProblem) -> Fraction:
    """Return the points of a route: its holds for a top, else a hold each and half for a plus."""
    if one.mark.top:
        return Fraction(one.holds or 0)
    reached = Fraction(2 * one.mark.hold + one.mark.plus, 2)
    return reached if one.holds is None else min(reached, Fraction(one.holds))
