"""What somebody has on problems, and the score that rules make of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple
from uuid import UUID


class Mark(NamedTuple):
    """What somebody has on one problem: `tries` seen, and in which try zone and top came; 0: did
    not come."""

    tries: int = 0
    zone: int = 0
    top: int = 0


NOTHING = Mark()


class Criterion(NamedTuple):
    """One thing that two are compared by; the greater `value` stands before."""

    code: str
    value: Fraction
    shown: str


class Tried(NamedTuple):
    """A problem that somebody tried; `points`: {flash, top, zone} of its own."""

    problem: UUID
    mark: Mark
    points: Mapping[str, int] | None = None


@dataclass(frozen=True, slots=True)
class Score:
    """What somebody has in a round.

    Parameters
    ----------
    criteria : what they are ranked by, the first first.
    points : for leagues; None where the rules count none.
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
        """Greater is better."""
        return tuple(criterion.value for criterion in self.criteria)


@dataclass(frozen=True, slots=True)
class Sums:
    """Over the problems of a round."""

    tops: int
    zones: int
    flashes: int
    tries_to_top: int
    tries_to_zone: int

    def more(self, code: str) -> Criterion:
        """More of it is better."""
        value: int = getattr(self, code.replace("-", "_"))
        return Criterion(code, Fraction(value), str(value))

    def fewer(self, code: str) -> Criterion:
        """Less of it is better."""
        value: int = getattr(self, code.replace("-", "_"))
        return Criterion(code, Fraction(-value), str(value))


def sums_of(tried: Iterable[Tried]) -> Sums:
    """Sums over what somebody tried."""
    marks = [one.mark for one in tried]
    return Sums(
        tops=sum(1 for mark in marks if mark.top),
        zones=sum(1 for mark in marks if mark.zone),
        flashes=sum(1 for mark in marks if mark.top == 1),
        tries_to_top=sum(mark.top for mark in marks),
        tries_to_zone=sum(mark.zone for mark in marks),
    )


def score_of(sums: Sums, points: Fraction | None, *rest: Criterion) -> Score:
    """A score whose first criterion is the points, where there are any."""
    first = () if points is None else (Criterion("points", points, shown(points)),)
    return Score(
        (*first, *rest), points, sums.tops, sums.zones, sums.flashes, sums.tries_to_top,
        sums.tries_to_zone,
    )  # fmt: skip


def best_of(each: Iterable[Fraction], best: int | None) -> Fraction:
    """The sum of the best `best`, of all where it is None."""
    return sum(sorted(each, reverse=True)[:best], Fraction(0))


def shown(points: Fraction) -> str:
    """Points as people read them, with at most two decimals."""
    return f"{float(points):.2f}".rstrip("0").rstrip(".")
