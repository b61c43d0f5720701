"""Who stands before whom, and why.

Somebody's standing is a row of criteria; two are compared by the first in which they differ, and
who differs in none shares a rank.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, TypeVar
from uuid import UUID

from walltopo_gym.competitions.scoring.score import Criterion, Score, best_of, shown
from walltopo_gym.competitions.sheet import RoundSheet

Who = TypeVar("Who")


class Standing(NamedTuple):
    """What somebody is ranked by: criteria, each with the round that it is of."""

    criteria: tuple[tuple[UUID | None, Criterion], ...]
    points: Fraction | None

    @property
    def key(self) -> tuple[Fraction, ...]:
        """Greater is better."""
        return tuple(criterion.value for _, criterion in self.criteria)


class Place(NamedTuple):
    """A rank, and whether it is shared."""

    rank: int
    tied: bool


@dataclass(frozen=True)
class Step:
    """One comparison of two; `decides`: the one in which they differ."""

    code: str
    round_id: UUID | None
    first: str
    second: str
    decides: bool


def standing_in(
    rounds: Sequence[RoundSheet], scores: Mapping[UUID, Score], reached: int
) -> Standing:
    """What a competitor is ranked by in a round: the score there, then in each round before.

    Parameters
    ----------
    scores : by round, of the first `reached` rounds at least.
    """
    criteria: list[tuple[UUID | None, Criterion]] = []
    for number, one in enumerate(reversed(rounds[:reached])):
        for criterion in scores[one.id].criteria:
            code = criterion.code if number == 0 else "countback"
            criteria.append((one.id, criterion._replace(code=code)))
    return Standing(tuple(criteria), scores[rounds[reached - 1].id].points)


def standing_in_all(
    rounds: Sequence[RoundSheet], scores: Mapping[UUID, Score], reached: int
) -> Standing:
    """What a competitor is ranked by in the end: how far they came, then how they did there."""
    last = rounds[reached - 1]
    there = standing_in(rounds, scores, reached)
    came = (last.id, Criterion("round", Fraction(reached), last.name))
    return Standing((came, *there.criteria), there.points)


def standing_in_league(scores: Iterable[Score], league_best: int | None, handicap: int) -> Standing:
    """What a competitor is ranked by over the rounds that they climbed in.

    The sum of the best, each with the handicap; equal sums: the best single round.
    """
    each = [(score.points or Fraction(0)) + handicap for score in scores]
    total, most = best_of(each, league_best), max(each)
    return Standing(
        ((None, Criterion("points", total, shown(total))),
         (None, Criterion("best-round", most, shown(most)))),
        total,
    )  # fmt: skip


def ranked(keys: Mapping[Who, tuple[Fraction, ...]]) -> dict[Who, Place]:
    """Ranks by keys, greater first; equal keys share one, and the next is as much later."""
    found: dict[Who, Place] = {}
    ordered = sorted(keys, key=lambda who: keys[who], reverse=True)
    first = 0
    while first < len(ordered):
        last = first
        while last + 1 < len(ordered) and keys[ordered[last + 1]] == keys[ordered[first]]:
            last += 1
        for who in ordered[first : last + 1]:
            found[who] = Place(first + 1, last > first)
        first = last + 1
    return found


def why(first: Standing, second: Standing) -> list[Step]:
    """The comparisons of two, down to the one that decides; none decides where they are tied."""
    steps = []
    for (round_id, mine), (_, theirs) in zip(first.criteria, second.criteria, strict=False):
        decides = mine.value != theirs.value
        steps.append(Step(mine.code, round_id, mine.shown, theirs.shown, decides))
        if decides:
            break
    return steps
