"""Candidate problems: their holds in order, and their random variation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from walltopo.scans.routes import Route
from walltopo_climb.movement.body import Body
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.spec import ProblemSpec

Floats = npt.NDArray[np.float64]

_MAX_HANDS, _MAX_FEET = 16, 8
_REACH = 0.9  # of the arm span: maximum distance of a hand hold from the resting hand
_FEET_BELOW = 0.25  # of the height: minimum depth of a foothold below a hand hold
_BESIDE = 0.5  # of the height: maximum sideways distance of a foothold from a hand hold


@dataclass(frozen=True)
class Candidate:
    """A candidate problem, as hold ids.

    Parameters
    ----------
    hands : the start holds, those between in any order, and the top. starts : number of start
        holds.
    feet : holds for feet only.
    """

    hands: tuple[int, ...]
    starts: int
    feet: tuple[int, ...] = ()

    @property
    def route(self) -> Route:
        """Return the problem as a route of a scan."""
        return Route(
            0,
            holds=(*self.hands, *self.feet),
            start=self.hands[: self.starts],
            top=self.hands[-1:],
            footholds=self.feet,
        )

    @property
    def holds(self) -> frozenset[int]:
        return frozenset((*self.hands, *self.feet))


class Sampler:
    """Samples and varies candidates, reproducibly by its random generator."""

    def __init__(
        self, pool: Pool, spec: ProblemSpec, body: Body, random: np.random.Generator
    ) -> None:
        self._pool, self._spec, self._body, self._random = pool, spec, body, random
        self._weights = pool.weights(spec)
        self._starts = pool.starts(body)

    def first(self) -> Candidate | None:
        """Sample a sequence of hand holds up the wall; return None if it finds no top."""
        begin = self._pick(np.where(self._starts, self._weights, 0.0))
        if begin is None:
            return None
        hands = [begin]
        beside = self._pick(self._second(begin))
        if beside is not None and self._random.random() < 0.7:
            hands.append(beside)
        starts = len(hands)
        # Both hands end on the top: the last move matches.
        wanted = max(1, self._spec.moves - 1 - int(self._random.integers(0, 2)))
        step = self._random.uniform(0.25, 0.6) * self._body.height
        while len(hands) < min(starts + wanted, _MAX_HANDS):
            after = self._pick(self._higher(hands, step))
            if after is None:
                break
            hands.append(after)
        if len(hands) <= starts:
            return None
        candidate = Candidate(self._numbers(hands), starts)
        for _ in range(int(self._random.integers(2, 6))):
            candidate = self._with_foot(candidate)
        return candidate

    def change_one(self, candidate: Candidate) -> Candidate:
        """Change one random hold of a candidate and return the result."""
        changes = (
            self._swapped,
            self._swapped,
            self._inserted,
            self._dropped,
            self._other_top,
            self._other_start,
            self._with_foot,
            self._with_foot,
            self._without_foot,
        )
        return changes[int(self._random.integers(len(changes)))](candidate)

    # Weights of holds for the next hand.

    def _second(self, begin: int) -> Floats:
        """Return the weights of holds for the other hand's start, beside the first one."""
        apart = self._pool.distances[begin]
        level = np.abs(self._pool.position[:, 2] - self._pool.position[begin, 2])
        height = self._body.height
        near = (apart > 0.05 * height) & (apart < 0.45 * height) & (level < 0.2 * height)
        return np.where(self._starts & near, self._weights, 0.0)

    def _higher(self, hands: list[int], step: float) -> Floats:
        """Return the weights of holds for the lower hand, above the resting hand."""
        stays, goes = hands[-1], hands[-2] if len(hands) > 1 else hands[-1]
        z = self._pool.position[:, 2]
        height = self._body.height
        max_reach = _REACH * self._body.span
        can = (z > z[goes] + 0.08 * height) & (z > z[stays] - 0.05 * height)
        can &= self._pool.distances[stays] < max_reach
        can[hands] = False
        way = (self._pool.distances[stays] - step) / (0.15 * height)
        return np.where(can, np.exp(-(way**2)) * self._weights, 0.0)

    def _around(self, row: int, taken: tuple[int, ...]) -> Floats:
        """Return the weights of holds that may replace a hold."""
        near = self._pool.distances[row] < 0.45 * self._body.height
        near[[self._pool.row_of[number] for number in taken]] = False
        return np.where(near, self._weights, 0.0)

    # Changes.

    def _swapped(self, candidate: Candidate) -> Candidate:
        middle = range(candidate.starts, len(candidate.hands) - 1)
        if not middle:
            return self._inserted(candidate)
        at = int(self._random.choice(np.array(middle)))
        return self._put(candidate, at, replace=True)

    def _inserted(self, candidate: Candidate) -> Candidate:
        if len(candidate.hands) >= _MAX_HANDS:
            return candidate
        return self._put(
            candidate, int(self._random.integers(candidate.starts, len(candidate.hands)))
        )

    def _dropped(self, candidate: Candidate) -> Candidate:
        middle = range(candidate.starts, len(candidate.hands) - 1)
        if not middle:
            return candidate
        at = int(self._random.choice(np.array(middle)))
        return replace(candidate, hands=(*candidate.hands[:at], *candidate.hands[at + 1 :]))

    def _other_top(self, candidate: Candidate) -> Candidate:
        last = len(candidate.hands) - 1
        if self._random.random() < 0.4 and last < _MAX_HANDS - 1:
            rows = [self._pool.row_of[number] for number in candidate.hands]
            after = self._pick(self._higher(rows, 0.4 * self._body.height))
            if after is not None and (number := self._numbers([after])[0]) not in candidate.feet:
                return replace(candidate, hands=(*candidate.hands, number))
        if self._random.random() < 0.3 and last > candidate.starts:
            return replace(candidate, hands=candidate.hands[:-1])
        return self._put(candidate, last, replace=True)

    def _other_start(self, candidate: Candidate) -> Candidate:
        if candidate.starts == 2 and self._random.random() < 0.3:
            return replace(candidate, hands=candidate.hands[1:], starts=1)
        first = self._pool.row_of[candidate.hands[0]]
        weights = self._second(first)
        weights[[self._pool.row_of[number] for number in candidate.holds]] = 0.0
        found = self._pick(weights)
        if found is None:
            return candidate
        (number,) = self._numbers([found])
        kept = candidate.hands[:1] if self._random.random() < 0.6 else ()
        start = (*kept, number)
        return Candidate((*start, *candidate.hands[candidate.starts :]), len(start), candidate.feet)

    def _with_foot(self, candidate: Candidate) -> Candidate:
        """Return the candidate with a foothold near the likely position of the feet."""
        if len(candidate.feet) >= _MAX_FEET:
            return candidate
        pool, height = self._pool, self._body.height
        hands = [pool.row_of[number] for number in candidate.hands]
        at = hands[int(self._random.integers(len(hands)))]
        below = pool.position[at, 2] - pool.position[:, 2]
        side = np.linalg.norm(pool.position[:, :2] - pool.position[at, :2], axis=1)
        can = (below > _FEET_BELOW * height) & (below < 0.75 * height) & (side < _BESIDE * height)
        can[[pool.row_of[number] for number in candidate.holds]] = False
        found = self._pick(np.where(can, np.where(pool.hands, 0.3, 1.0), 0.0))
        return (
            candidate
            if found is None
            else replace(candidate, feet=(*candidate.feet, *self._numbers([found])))
        )

    def _without_foot(self, candidate: Candidate) -> Candidate:
        if not candidate.feet:
            return candidate
        at = int(self._random.integers(len(candidate.feet)))
        return replace(candidate, feet=(*candidate.feet[:at], *candidate.feet[at + 1 :]))

    def _put(self, candidate: Candidate, at: int, replace: bool = False) -> Candidate:
        """Return the candidate with another hand hold near the one at `at`, or instead of it."""
        found = self._pick(
            self._around(self._pool.row_of[candidate.hands[at]], tuple(candidate.holds))
        )
        if found is None:
            return candidate
        after = candidate.hands[at + 1 :] if replace else candidate.hands[at:]
        hands = (*candidate.hands[:at], *self._numbers([found]), *after)
        return Candidate(hands, candidate.starts, candidate.feet)

    def _pick(self, weights: Floats) -> int | None:
        total = float(weights.sum())
        if total <= 0:
            return None
        return int(self._random.choice(len(weights), p=weights / total))

    def _numbers(self, rows: list[int]) -> tuple[int, ...]:
        return tuple(int(self._pool.ids[row]) for row in rows)
