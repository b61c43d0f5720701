"""Score candidates by their distance from a specification, with movement and grade models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from walltopo.scans.holds import Hold
from walltopo_climb.grades.of_scan import Climbed, Scale, climb_route
from walltopo_climb.movement.body import ADULT
from walltopo_climb.movement.sequence import LIMBS, Sequence, find_sequence
from walltopo_climb.movement.statics import NONE
from walltopo_climb.problems.candidate import Candidate
from walltopo_climb.problems.pool import Pool, fits_kind, fits_steepness
from walltopo_climb.problems.spec import ProblemSpec

# A way in which a candidate differs from its specification; a key that pages translate.
Violation = str
Fits = Callable[[Hold], bool]

# Prices of violations, in grades that the model may be off instead. They only decide which part of
# the specification the search gives up first.
_MOVE, _STYLE, _UNUSED, _LEAP = 0.6, 2.0, 0.3, 1.0
_STUCK, _BODY = 20.0, 6.0
_RISE = 0.6  # of the height: minimum rise of a proper problem
_DYNAMIC = 0.04  # of the height beyond reach: minimum of a noticeable leap


@dataclass(frozen=True)
class Judged:
    """A scored candidate; `violations` is empty if it meets the specification.

    Parameters
    ----------
    off : distance from the specification, in grades.
    difficulty, grade : see `walltopo_climb.grades.of_scan`.
    moves : number of hand moves. used : holds that an adult, and the requested body, use.
    """

    candidate: Candidate
    off: float
    difficulty: float
    grade: float
    known: bool
    moves: int
    used: frozenset[int]
    reached: bool
    violations: tuple[Violation, ...]


class Judge:
    """Scores candidates, each once."""

    def __init__(self, pool: Pool, spec: ProblemSpec, scale: Scale) -> None:
        self._pool, self._spec, self._scale = pool, spec, scale
        self._body = spec.body
        low, high = spec.ends
        # Outside the grades of the training data, the model cannot tell problems apart.
        learnt = scale.model.learnt
        first, last = (scale.grade(k, True) for k in (learnt.easiest, learnt.hardest))
        self._low, self._high = max(low, min(first, last)), min(high, max(first, last))
        self._easy = high < first
        self._seen: dict[tuple[frozenset[int], tuple[int, ...], int], Judged] = {}

    def __len__(self) -> int:
        return len(self._seen)

    @property
    def seen(self) -> tuple[Judged, ...]:
        """Return all scored candidates, in order."""
        return tuple(self._seen.values())

    def of(self, candidate: Candidate) -> Judged:
        """Return the score of a candidate."""
        key = (
            candidate.holds,
            (*sorted(candidate.hands[: candidate.starts]), candidate.hands[-1]),
            len(candidate.feet),
        )
        if key not in self._seen:
            self._seen[key] = self._judged(candidate)
        return self._seen[key]

    def _judged(self, candidate: Candidate) -> Judged:
        climbed = climb_route(
            candidate.route, self._pool.near(tuple(candidate.holds)), self._pool.unit
        )
        if climbed is None or not climbed.moves.reached:
            left = 1.0 if climbed is None else self._missing(climbed, climbed.moves)
            return Judged(
                candidate, _STUCK + left, 0.0, 0.0, False, 0, frozenset(), False, ("top",)
            )
        difficulty = float(self._scale.model.difficulties(climbed.features[None])[0])
        grade = self._scale.grade(difficulty, climbed.known)
        own = climbed.moves if self._body == ADULT else find_sequence(climbed.climb, self._body)
        used = _used_holds(climbed, climbed.moves) | (
            _used_holds(climbed, own) if own else frozenset()
        )
        moves = _hand_moves(climbed.moves)
        prices = {
            "grade": self._grade(grade, climbed.moves),
            "moves": _MOVE * abs(moves - self._spec.moves),
            "steepness": self._share(candidate, lambda one: fits_steepness(one, self._spec)),
            "holds": self._share(
                candidate, lambda one: fits_kind(one, self._spec, self._pool.unit)
            ),
            "reach": self._reach(climbed.moves),
            "body": self._fits_body(climbed, own),
        }
        idle = _UNUSED * len(candidate.holds - used) + self._shape_price(candidate)
        off = sum(prices.values()) + idle
        violations = self._violations(
            prices, grade, moves, self._scale.range(difficulty, climbed.known).low == 0
        )
        return Judged(
            candidate, off, difficulty, grade, climbed.known, moves, used, True, violations
        )

    def _grade(self, grade: float, moves: Sequence) -> float:
        low, high = self._low, self._high
        price = max(low - grade, grade - high, 0.0) + 0.2 * abs(grade - (low + high) / 2)
        if self._easy:  # the model knows nothing easier, but less effort is not harder
            price += 0.5 * moves.moves[moves.crux].effort
        return price

    def _share(self, candidate: Candidate, fits: Fits) -> float:
        """Return the price of hand holds of another kind than requested."""
        rows = [self._pool.by_id[number] for number in candidate.hands]
        return _STYLE * sum(not fits(row) for row in rows) / len(rows)

    def _reach(self, moves: Sequence) -> float:
        leaps = [move.beyond / moves.body.height for move in moves.moves if move.beyond > 0]
        if self._spec.reach == "static":
            return _LEAP * len(leaps) + 4 * sum(leaps)
        if self._spec.reach == "dynamic":
            return 0.0 if max(leaps, default=0.0) >= _DYNAMIC else _STYLE
        return 0.0

    def _fits_body(self, climbed: Climbed, own: Sequence | None) -> float:
        """Return the price if the requested body does not get up, or leaps without request."""
        if own is None:
            return _BODY + 1.0
        if not own.reached:
            return _BODY + self._missing(climbed, own)
        if own.body == ADULT or self._spec.reach == "dynamic":
            return 0.0
        return 0.5 * sum(move.beyond > 0 for move in own.moves)

    def _shape_price(self, candidate: Candidate) -> float:
        """Return the price of a problem that does not rise, or does not end at its highest hold."""
        heights = [self._pool.position[self._pool.row_of[number], 2] for number in candidate.hands]
        low = _RISE * self._body.height - (heights[-1] - heights[0])
        return 2 * max(low, 0.0) + 2 * max(max(heights) - heights[-1], 0.0)

    def _missing(self, climbed: Climbed, moves: Sequence) -> float:
        """Return the metres from the lower hand's last hold to the top."""
        height = climbed.climb.grips.position[:, 2]
        last = moves.moves[-1].limbs
        return max(0.0, float(height[climbed.climb.top[0]] - min(height[last[0]], height[last[1]])))

    def _violations(
        self, prices: dict[str, float], grade: float, moves: int, is_open: bool
    ) -> tuple[Violation, ...]:
        low, high = self._spec.ends
        # Most of the holds are unlike the request.
        found = [name for name in ("steepness", "holds") if prices[name] > _STYLE / 2]
        found += [name for name in ("reach", "body") if prices[name] > 0]
        if not low - 0.5 <= grade <= high + 0.5:
            found.append("easy" if self._easy and is_open else "grade")
        if abs(moves - self._spec.moves) > 1:
            found.append("moves")
        return tuple(found)


def _used_holds(climbed: Climbed, moves: Sequence) -> frozenset[int]:
    """Return the ids of the holds that some limb uses."""
    limbs = {i for move in moves.moves for i in move.limbs if i != NONE}
    ends = {*climbed.climb.start, *climbed.climb.top}
    return frozenset(climbed.holds[i].id for i in limbs | ends)


def _hand_moves(moves: Sequence) -> int:
    return sum(move.limb in LIMBS[:2] for move in moves.moves)
