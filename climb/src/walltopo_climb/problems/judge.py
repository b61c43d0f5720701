"""How far a draft is from what is wished: judged by the movement model and the grade model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from walltopo.scans.holds import HoldRow
from walltopo_climb.grades.of_scan import Climbed, Scale, climb_route
from walltopo_climb.movement.body import ADULT
from walltopo_climb.movement.sequence import LIMBS, Sequence, find_sequence
from walltopo_climb.movement.statics import NONE
from walltopo_climb.problems.draft import Draft
from walltopo_climb.problems.pool import Pool, fits_kind, fits_steepness
from walltopo_climb.problems.wish import Wish

# What a wish asked for and a draft has not, as keys that a page says in its own words.
Miss = str
Fits = Callable[[HoldRow], bool]

# Prices of what is not as wished, in grades that the model may be off instead; they only say what
# the search gives up first.
_MOVE, _STYLE, _UNUSED, _LEAP = 0.6, 2.0, 0.3, 1.0
_STUCK, _BODY = 20.0, 6.0
_RISE = 0.6  # of the height: less is hardly a problem
_DYNAMIC = 0.04  # of the height beyond reach: from there on it is a leap that one notices


@dataclass(frozen=True)
class Judged:
    """A draft, judged; `misses` is empty where all is as wished.

    Parameters
    ----------
    off : how far it is from the wish, in grades.
    place, grade : see `walltopo_climb.grades.of_scan`.
    moves : of hands. used : holds that an adult, and the wished body, use.
    """

    draft: Draft
    off: float
    place: float
    grade: float
    known: bool
    moves: int
    used: frozenset[int]
    reached: bool
    misses: tuple[Miss, ...]


class Judge:
    """Judges drafts, each once."""

    def __init__(self, pool: Pool, wish: Wish, scale: Scale) -> None:
        self._pool, self._wish, self._scale = pool, wish, scale
        self._body = wish.body
        low, high = wish.ends
        # Below the easiest grade that was learnt all problems look alike, and above the hardest.
        learnt = scale.model.learnt
        first, last = (scale.grade(k, True) for k in (learnt.easiest, learnt.hardest))
        self._low, self._high = max(low, min(first, last)), min(high, max(first, last))
        self._easy = high < first
        self._seen: dict[tuple[frozenset[int], tuple[int, ...], int], Judged] = {}

    def __len__(self) -> int:
        return len(self._seen)

    @property
    def seen(self) -> tuple[Judged, ...]:
        """All that was judged, in that order."""
        return tuple(self._seen.values())

    def of(self, draft: Draft) -> Judged:
        """How far a draft is from the wish."""
        key = draft.holds, (*sorted(draft.hands[: draft.starts]), draft.hands[-1]), len(draft.feet)
        if key not in self._seen:
            self._seen[key] = self._judged(draft)
        return self._seen[key]

    def _judged(self, draft: Draft) -> Judged:
        climbed = climb_route(draft.route, self._pool.near(tuple(draft.holds)), self._pool.unit)
        if climbed is None or not climbed.moves.reached:
            left = 1.0 if climbed is None else self._missing(climbed, climbed.moves)
            return Judged(draft, _STUCK + left, 0.0, 0.0, False, 0, frozenset(), False, ("top",))
        place = float(self._scale.model.places(climbed.features[None])[0])
        grade = self._scale.grade(place, climbed.known)
        own = climbed.moves if self._body == ADULT else find_sequence(climbed.climb, self._body)
        used = _used(climbed, climbed.moves) | (_used(climbed, own) if own else frozenset())
        moves = _hand_moves(climbed.moves)
        prices = {
            "grade": self._grade(grade, climbed.moves),
            "moves": _MOVE * abs(moves - self._wish.moves),
            "steepness": self._share(draft, lambda one: fits_steepness(one, self._wish)),
            "holds": self._share(
                draft, lambda one: fits_kind(one, self._wish, self._pool.unit)
            ),
            "reach": self._reach(climbed.moves),
            "body": self._fits_body(climbed, own),
        }  # fmt: skip
        idle = _UNUSED * len(draft.holds - used) + self._shape(draft)
        off = sum(prices.values()) + idle
        misses = self._misses(
            prices, grade, moves, self._scale.range(place, climbed.known).low == 0
        )
        return Judged(draft, off, place, grade, climbed.known, moves, used, True, misses)

    def _grade(self, grade: float, moves: Sequence) -> float:
        low, high = self._low, self._high
        price = max(low - grade, grade - high, 0.0) + 0.2 * abs(grade - (low + high) / 2)
        if self._easy:  # the model knows nothing easier: less effort is at least no harder
            price += 0.5 * moves.moves[moves.crux].effort
        return price

    def _share(self, draft: Draft, fits: Fits) -> float:
        """Of the hand holds, those that are not of the wished kind."""
        rows = [self._pool.by_id[number] for number in draft.hands]
        return _STYLE * sum(not fits(row) for row in rows) / len(rows)

    def _reach(self, moves: Sequence) -> float:
        leaps = [move.beyond / moves.body.height for move in moves.moves if move.beyond > 0]
        if self._wish.reach == "static":
            return _LEAP * len(leaps) + 4 * sum(leaps)
        if self._wish.reach == "dynamic":
            return 0.0 if max(leaps, default=0.0) >= _DYNAMIC else _STYLE
        return 0.0

    def _fits_body(self, climbed: Climbed, own: Sequence | None) -> float:
        """The wished body must get up; without a leap, where no leap was wished for."""
        if own is None:
            return _BODY + 1.0
        if not own.reached:
            return _BODY + self._missing(climbed, own)
        if own.body == ADULT or self._wish.reach == "dynamic":
            return 0.0
        return 0.5 * sum(move.beyond > 0 for move in own.moves)

    def _shape(self, draft: Draft) -> float:
        """A problem goes up, and ends at its highest hold."""
        heights = [self._pool.place[self._pool.row_of[number], 2] for number in draft.hands]
        low = _RISE * self._body.height - (heights[-1] - heights[0])
        return 2 * max(low, 0.0) + 2 * max(max(heights) - heights[-1], 0.0)

    def _missing(self, climbed: Climbed, moves: Sequence) -> float:
        """Metres from where the hands end to the top."""
        place = climbed.climb.grips.position[:, 2]
        last = moves.moves[-1].limbs
        return max(0.0, float(place[climbed.climb.top[0]] - min(place[last[0]], place[last[1]])))

    def _misses(
        self, prices: dict[str, float], grade: float, moves: int, is_open: bool
    ) -> tuple[Miss, ...]:
        low, high = self._wish.ends
        missed = [
            name for name in ("steepness", "holds") if prices[name] > _STYLE / 2
        ]  # most of the holds are others
        missed += [name for name in ("reach", "body") if prices[name] > 0]
        if not low - 0.5 <= grade <= high + 0.5:
            missed.append("easy" if self._easy and is_open else "grade")
        if abs(moves - self._wish.moves) > 1:
            missed.append("moves")
        return tuple(missed)


def _used(climbed: Climbed, moves: Sequence) -> frozenset[int]:
    """Ids of the holds that some limb is on."""
    limbs = {i for move in moves.moves for i in move.limbs if i != NONE}
    ends = {*climbed.climb.start, *climbed.climb.top}
    return frozenset(climbed.holds[i].id for i in limbs | ends)


def _hand_moves(moves: Sequence) -> int:
    return sum(move.limb in LIMBS[:2] for move in moves.moves)
