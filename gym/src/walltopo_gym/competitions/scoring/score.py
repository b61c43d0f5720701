"""Marks on problems, and the score that rules make of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, NamedTuple
from uuid import UUID

_TOP: Final = 1_000_000  # above each hold


class Mark(NamedTuple):
    """A competitor's mark on one problem.

    Parameters
    ----------
    tries : number of them.
    zone, top : the tries that reached them; 0 if none did.
    hold, plus, high_try : the best high point on a route, and the try that reached it; 0 on a
        boulder and after a top.
    seconds : climbing time to the best high point or the top; None if unknown.
    """

    tries: int = 0
    zone: int = 0
    top: int = 0
    hold: int = 0
    plus: bool = False
    high_try: int = 0
    seconds: int | None = None

    @property
    def height(self) -> int:
        """Return a number that orders marks on a route: 0 without a try, the greatest for a top."""
        if self.top:
            return _TOP
        return 2 * self.hold + self.plus + 1 if self.tries else 0

    @property
    def best_try(self) -> int:
        """Return the try that reached the top or the best high point."""
        return self.top or self.high_try

    @property
    def high(self) -> str:
        """Return the high point as judges write it: 34, 34+ or TOP; empty without a try."""
        if self.top:
            return "TOP"
        return f"{self.hold}{'+' if self.plus else ''}" if self.tries else ""


NOTHING = Mark()


class Criterion(NamedTuple):
    """One criterion of a comparison; the greater `value` ranks first."""

    code: str
    value: Fraction
    shown: str


class AttemptedProblem(NamedTuple):
    """An attempted problem and its result; `points` by {flash, top, zone} if it has its own;
    `holds`: number of holds of a route, if known."""

    problem: UUID
    mark: Mark
    points: Mapping[str, int] | None = None
    holds: int | None = None


@dataclass(frozen=True, slots=True)
class Score:
    """A competitor's score in a round.

    Parameters
    ----------
    criteria : in order of comparison.
    points : for leagues; None if the rules count none.
    result : the score of a lead round as text; empty in a boulder round.
    tie_breaks : in a final, compared after the rounds before.
    """

    criteria: tuple[Criterion, ...]
    points: Fraction | None
    tops: int
    zones: int
    flashes: int
    tries_to_top: int
    tries_to_zone: int
    result: str = ""
    tie_breaks: tuple[Criterion, ...] = ()

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
    tries_to_high: int

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
        tries_to_high=sum(mark.best_try for mark in marks),
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


def format_time(seconds: int) -> str:
    """Return a climbing time as minutes and seconds."""
    return f"{seconds // 60}:{seconds % 60:02}"


def format_points(points: Fraction) -> str:
    """Return points as text, with at most two decimals."""
    return f"{float(points):.2f}".rstrip("0").rstrip(".")
