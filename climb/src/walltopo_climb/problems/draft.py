"""A problem that is thought of: which holds, in which order, and how it is varied by chance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from walltopo.scans.routes import Route
from walltopo_climb.movement.body import Body
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.wish import Wish

Floats = npt.NDArray[np.float64]

_MOST_HANDS, _MOST_FEET = 16, 8
_REACH = 0.9  # of the arm span: farther from the hand that stays goes no hand
_FEET_BELOW = 0.25  # of the height: so far below the top hand at least lies a foothold
_BESIDE = 0.5  # of the height: so far from a hand hold at most


@dataclass(frozen=True)
class Draft:
    """Hold ids.

    Parameters
    ----------
    hands : the start, those between in any order, and the top. starts : how many are the start.
    feet : for feet alone.
    """

    hands: tuple[int, ...]
    starts: int
    feet: tuple[int, ...] = ()

    @property
    def route(self) -> Route:
        """As a route of a scan."""
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


class Chance:
    """Makes and varies drafts. The same seed makes the same ones."""

    def __init__(self, pool: Pool, wish: Wish, body: Body, random: np.random.Generator) -> None:
        self._pool, self._wish, self._body, self._random = pool, wish, body, random
        self._liked = pool.liked(wish)
        self._starts = pool.starts(body)

    def first(self) -> Draft | None:
        """A walk up the wall, hand over hand; None where it comes to nothing."""
        begin = self._pick(np.where(self._starts, self._liked, 0.0))
        if begin is None:
            return None
        hands = [begin]
        beside = self._pick(self._second(begin))
        if beside is not None and self._random.random() < 0.7:
            hands.append(beside)
        starts = len(hands)
        # Both hands end on the top: the last move matches.
        wanted = max(1, self._wish.moves - 1 - int(self._random.integers(0, 2)))
        step = self._random.uniform(0.25, 0.6) * self._body.height
        while len(hands) < min(starts + wanted, _MOST_HANDS):
            after = self._pick(self._higher(hands, step))
            if after is None:
                break
            hands.append(after)
        if len(hands) <= starts:
            return None
        draft = Draft(self._numbers(hands), starts)
        for _ in range(int(self._random.integers(2, 6))):
            draft = self._with_foot(draft)
        return draft

    def varied(self, draft: Draft) -> Draft:
        """The draft with one thing changed."""
        changes = (
            self._swapped, self._swapped, self._inserted, self._dropped, self._other_top,
            self._other_start, self._with_foot, self._with_foot, self._without_foot,
        )  # fmt: skip
        return changes[int(self._random.integers(len(changes)))](draft)

    # Where hands may go.

    def _second(self, begin: int) -> Floats:
        """The other hand's start: beside the first one."""
        apart = self._pool.apart[begin]
        level = np.abs(self._pool.place[:, 2] - self._pool.place[begin, 2])
        height = self._body.height
        near = (apart > 0.05 * height) & (apart < 0.45 * height) & (level < 0.2 * height)
        return np.where(self._starts & near, self._liked, 0.0)

    def _higher(self, hands: list[int], step: float) -> Floats:
        """From the lower hand past the one that stays."""
        stays, goes = hands[-1], hands[-2] if len(hands) > 1 else hands[-1]
        z = self._pool.place[:, 2]
        height = self._body.height
        most = _REACH * self._body.span
        can = (z > z[goes] + 0.08 * height) & (z > z[stays] - 0.05 * height)
        can &= self._pool.apart[stays] < most
        can[hands] = False
        way = (self._pool.apart[stays] - step) / (0.15 * height)
        return np.where(can, np.exp(-(way**2)) * self._liked, 0.0)

    def _around(self, row: int, taken: tuple[int, ...]) -> Floats:
        """In the stead of a hold."""
        near = self._pool.apart[row] < 0.45 * self._body.height
        near[[self._pool.row_of[number] for number in taken]] = False
        return np.where(near, self._liked, 0.0)

    # Changes.

    def _swapped(self, draft: Draft) -> Draft:
        middle = range(draft.starts, len(draft.hands) - 1)
        if not middle:
            return self._inserted(draft)
        at = int(self._random.choice(np.array(middle)))
        return self._put(draft, at, replace=True)

    def _inserted(self, draft: Draft) -> Draft:
        if len(draft.hands) >= _MOST_HANDS:
            return draft
        return self._put(draft, int(self._random.integers(draft.starts, len(draft.hands))))

    def _dropped(self, draft: Draft) -> Draft:
        middle = range(draft.starts, len(draft.hands) - 1)
        if not middle:
            return draft
        at = int(self._random.choice(np.array(middle)))
        return replace(draft, hands=(*draft.hands[:at], *draft.hands[at + 1 :]))

    def _other_top(self, draft: Draft) -> Draft:
        last = len(draft.hands) - 1
        if self._random.random() < 0.4 and last < _MOST_HANDS - 1:
            rows = [self._pool.row_of[number] for number in draft.hands]
            after = self._pick(self._higher(rows, 0.4 * self._body.height))
            if after is not None and (number := self._numbers([after])[0]) not in draft.feet:
                return replace(draft, hands=(*draft.hands, number))
        if self._random.random() < 0.3 and last > draft.starts:
            return replace(draft, hands=draft.hands[:-1])
        return self._put(draft, last, replace=True)

    def _other_start(self, draft: Draft) -> Draft:
        if draft.starts == 2 and self._random.random() < 0.3:
            return replace(draft, hands=draft.hands[1:], starts=1)
        first = self._pool.row_of[draft.hands[0]]
        weights = self._second(first)
        weights[[self._pool.row_of[number] for number in draft.holds]] = 0.0
        found = self._pick(weights)
        if found is None:
            return draft
        (number,) = self._numbers([found])
        kept = draft.hands[:1] if self._random.random() < 0.6 else ()
        start = (*kept, number)
        return Draft((*start, *draft.hands[draft.starts :]), len(start), draft.feet)

    def _with_foot(self, draft: Draft) -> Draft:
        """A foothold near where the feet will be."""
        if len(draft.feet) >= _MOST_FEET:
            return draft
        pool, height = self._pool, self._body.height
        hands = [pool.row_of[number] for number in draft.hands]
        at = hands[int(self._random.integers(len(hands)))]
        below = pool.place[at, 2] - pool.place[:, 2]
        side = np.linalg.norm(pool.place[:, :2] - pool.place[at, :2], axis=1)
        can = (below > _FEET_BELOW * height) & (below < 0.75 * height) & (side < _BESIDE * height)
        can[[pool.row_of[number] for number in draft.holds]] = False
        found = self._pick(np.where(can, np.where(pool.hands, 0.3, 1.0), 0.0))
        return draft if found is None else replace(
            draft, feet=(*draft.feet, *self._numbers([found]))
        )  # fmt: skip

    def _without_foot(self, draft: Draft) -> Draft:
        if not draft.feet:
            return draft
        at = int(self._random.integers(len(draft.feet)))
        return replace(draft, feet=(*draft.feet[:at], *draft.feet[at + 1 :]))

    def _put(self, draft: Draft, at: int, replace: bool = False) -> Draft:
        """Another hand hold near the one at `at`: in its stead, or before it."""
        found = self._pick(self._around(self._pool.row_of[draft.hands[at]], tuple(draft.holds)))
        if found is None:
            return draft
        after = draft.hands[at + 1 :] if replace else draft.hands[at:]
        hands = (*draft.hands[:at], *self._numbers([found]), *after)
        return Draft(hands, draft.starts, draft.feet)

    def _pick(self, weights: Floats) -> int | None:
        total = float(weights.sum())
        if total <= 0:
            return None
        return int(self._random.choice(len(weights), p=weights / total))

    def _numbers(self, rows: list[int]) -> tuple[int, ...]:
        return tuple(int(self._pool.ids[row]) for row in rows)
