"""Whoever climbs most: each problem counts once."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction

from walltopo_gym.competitions.scoring.score import Score, Tried, score_of, sums_of


def score_most(tried: Collection[Tried]) -> Score:
    """A point a top; equal tops: more flashes, then fewer tries to the tops."""
    sums = sums_of(tried)
    return score_of(sums, Fraction(sums.tops), sums.more("flashes"), sums.fewer("tries-to-top"))
