"""Rank competitors and explain the order.

A standing is a list of criteria. Two standings are compared by the first criterion in which they
differ; equal standings share a rank.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, TypeVar
from uuid import UUID

from walltopo_gym.competitions.scoring.score import Criterion, Score, best_of, format_points
from walltopo_gym.competitions.sheet import RoundSheet

Who = TypeVar("Who")


class Standing(NamedTuple):
    """The criteria of a competitor, each with its round."""

    criteria: tuple[tuple[UUID | None, Criterion], ...]
    points: Fraction | None

    @property
    def key(self) -> tuple[Fraction, ...]:
        """Return the sort key; greater is better."""
        return tuple(criterion.value for _, criterion in self.criteria)


class Rank(NamedTuple):
    """A rank, and whether it is shared."""

    rank: int
    tied: bool


@dataclass(frozen=True)
class Step:
    """One criterion by which two competitors are compared; `decides`: whether they differ in it."""

    code: str
    round_id: UUID | None
    first: str
    second: str
    decides: bool


def standing_in(
    rounds: Sequence[RoundSheet], scores: Mapping[UUID, Score], reached: int
) -> Standing:
    """Return the standing in a round: the score there, then in each round before, and in a final
    the tie-breaks.

    Parameters
    ----------
    scores : by round, at least of the first `reached` rounds.
    """
    criteria: list[tuple[UUID | None, Criterion]] = []
    for number, one in enumerate(reversed(rounds[:reached])):
        for criterion in scores[one.id].criteria:
            code = criterion.code if number == 0 else "countback"
            criteria.append((one.id, criterion._replace(code=code)))
    last = rounds[reached - 1]
    if last.kind == "final":
        criteria += [(last.id, criterion) for criterion in scores[last.id].tie_breaks]
    return Standing(tuple(criteria), scores[last.id].points)


def standing_in_all(
    rounds: Sequence[RoundSheet], scores: Mapping[UUID, Score], reached: int
) -> Standing:
    """Return the final standing: the last round reached, then the score there."""
    last = rounds[reached - 1]
    there = standing_in(rounds, scores, reached)
    came = (last.id, Criterion("round", Fraction(reached), last.name))
    return Standing((came, *there.criteria), there.points)


def standing_in_league(scores: Iterable[Score], league_best: int | None, handicap: int) -> Standing:
    """Return the standing over the rounds of a league.

    It is the sum of the best rounds, each with the handicap, then the best single round.
    """
    each = [(score.points or Fraction(0)) + handicap for score in scores]
    total, most = best_of(each, league_best), max(each)
    return Standing(
        (
            (None, Criterion("points", total, format_points(total))),
            (None, Criterion("best-round", most, format_points(most))),
        ),
        total,
    )


def ranks_by_key(keys: Mapping[Who, tuple[Fraction, ...]]) -> dict[Who, Rank]:
    """Return ranks by keys, greater first. Equal keys share a rank, and the next rank skips as
    many."""
    found: dict[Who, Rank] = {}
    ordered = sorted(keys, key=lambda who: keys[who], reverse=True)
    first = 0
    while first < len(ordered):
        last = first
        while last + 1 < len(ordered) and keys[ordered[last + 1]] == keys[ordered[first]]:
            last += 1
        for who in ordered[first : last + 1]:
            found[who] = Rank(first + 1, last > first)
        first = last + 1
    return found


def compared_criteria(first: Standing, second: Standing) -> list[Step]:
    """Return the compared criteria of two, down to the deciding one; none decides a tie."""
    steps = []
    for (round_id, mine), (_, theirs) in zip(first.criteria, second.criteria, strict=False):
        decides = mine.value != theirs.value
        steps.append(Step(mine.code, round_id, mine.shown, theirs.shown, decides))
        if decides:
            break
    return steps
