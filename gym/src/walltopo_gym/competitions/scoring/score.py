"""Marks on problems, and the score that rules make of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple
from uuid import UUID


class Mark(NamedTuple):
    """A competitor's mark on one problem: number of `tries`, and the tries that reached zone and
    top (0: not reached)."""

    tries: int = 0
    zone: int = 0
    top: int = 0


NOTHING = Mark()


class Criterion(NamedTuple):
    """One criterion of a comparison; the greater `value` ranks first."""

    code: str
    value: Fraction
    shown: str


class AttemptedProblem(NamedTuple):
    """An attempted problem and its result; `points` by {flash, top, zone} if it has its own."""

    problem: UUID
    mark: Mark
    points: Mapping[str, int] | None = None


@dataclass(frozen=True, slots=True)
class Score:
    """A competitor's score in a round.

    Parameters
    ----------
    criteria : in order of comparison.
    points : for leagues; None if the rules count none.
    """

    criteria: tuple[Criterion, ...]
    points: Fraction | None
    tops: int
    zones: int
    flashes: int
    tries_to_top: int
    tries_to_zone: int

    @property
    def key(self) -> tuple[Fraction, ...]:
        """Return the sort key; greater is better."""
        return tuple(criterion.value for criterion in self.criteria)


@dataclass(frozen=True, slots=True)
class Sums:
    """Sums over the problems of a round."""

    tops: int
    zones: int
    flashes: int
    tries_to_top: int
    tries_to_zone: int

    def more(self, code: str) -> Criterion:
        """Return a criterion of which more is better."""
        value: int = getattr(self, code.replace("-", "_"))
        return Criterion(code, Fraction(value), str(value))

    def fewer(self, code: str) -> Criterion:
        """Return a criterion of which less is better."""
        value: int = getattr(self, code.replace("-", "_"))
        return Criterion(code, Fraction(-value), str(value))


def sums_of(tried: Iterable[AttemptedProblem]) -> Sums:
    """Return the sums over tried problems."""
    marks = [one.mark for one in tried]
    return Sums(
        tops=sum(1 for mark in marks if mark.top),
        zones=sum(1 for mark in marks if mark.zone),
        flashes=sum(1 for mark in marks if mark.top == 1),
        tries_to_top=sum(mark.top for mark in marks),
        tries_to_zone=sum(mark.zone for mark in marks),
    )


def score_of(sums: Sums, points: Fraction | None, *rest: Criterion) -> Score:
    """Return a score whose first criterion is the points, if the rules have them."""
    first = () if points is None else (Criterion("points", points, format_points(points)),)
    return Score(
        (*first, *rest),
        points,
        sums.tops,
        sums.zones,
        sums.flashes,
        sums.tries_to_top,
        sums.tries_to_zone,
    )


def best_of(each: Iterable[Fraction], best: int | None) -> Fraction:
    """Return the sum of the best `best` values; of all if it is None."""
    return sum(sorted(each, reverse=True)[:best], Fraction(0))


def format_points(points: Fraction) -> str:
    """Return points as text, with at most two decimals."""
    return f"{float(points):.2f}".rstrip("0").rstrip(".")
