"""A slow scorer, by the words of the rules: from all events at once, and by comparing all pairs.

It shares no code with the board but the shape of sheet and event.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from fractions import Fraction
from uuid import UUID

from walltopo_gym.competitions.ledger import Fact
from walltopo_gym.competitions.sheet import Competitor, RoundSheet, Sheet, Task

Key = tuple[Fraction, ...]
Mark = tuple[int, int, int]  # tries, zone, top


class Reference:
    """Ranks by the events alone.

    Parameters
    ----------
    facts : in any order, some of them more than once.
    """

    def __init__(self, sheet: Sheet, facts: Sequence[Fact]) -> None:
        self.sheet = sheet
        self.facts = list({fact.id: fact for fact in facts}.values())

        self._counting: dict[UUID, bool] = {}
        self._about = defaultdict[tuple[UUID, UUID | None], list[Fact]](list)
        self._on = defaultdict[UUID | None, list[Fact]](list)
        for fact in self.facts:
            self._about[fact.entry, fact.problem].append(fact)
            self._on[fact.target].append(fact)

    def counts(self, fact: Fact) -> bool:
        if fact.id not in self._counting:
            self._counting[fact.id] = not any(
                other.kind in ("attempt", "zone", "top", "void", "out") and self.counts(other)
                for other in self._on[fact.id]
            )
        return self._counting[fact.id]

    def is_out(self, who: Competitor) -> bool:
        about = self._about[who.id, None]
        return any(fact.kind == "out" and self.counts(fact) for fact in about)

    def mark(self, who: Competitor, task: Task) -> Mark:
        if task.categories and who.category not in task.categories:
            return 0, 0, 0
        kinds = "attempt", "zone", "top"
        about = self._about[who.id, task.id]
        here = [fact for fact in about if fact.kind in kinds and self.counts(fact)]
        tries = [fact.n or 0 for fact in here]
        zones = [fact.n or 0 for fact in here if fact.kind in ("zone", "top")]
        tops = [fact.n or 0 for fact in here if fact.kind == "top"]
        return max(tries, default=0), min(zones, default=0), min(tops, default=0)

    def key(self, who: Competitor, one: RoundSheet) -> Key | None:
        """Return what a round's rules rank by."""
        if one.starters is not None and who.id not in one.starters:
            return None
        marks = [(task, self.mark(who, task)) for task in one.problems]
        began = one.starters is not None and one.begun_at is not None
        if not any(tries for _, (tries, _, _) in marks) and not began:
            return None
        return self._by_rules(who, one, marks)

    def _by_rules(
        self, who: Competitor, one: RoundSheet, tried: Sequence[tuple[Task, Mark]]
    ) -> Key:
        marks = [mark for _, mark in tried]
        tops = Fraction(sum(1 for _, _, top in marks if top))
        zones = Fraction(sum(1 for _, zone, _ in marks if zone))
        flashes = Fraction(sum(1 for _, _, top in marks if top == 1))
        to_top = Fraction(sum(top for _, _, top in marks))
        to_zone = Fraction(sum(zone for _, zone, _ in marks))
        rules = one.scoring.rules
        if rules == "ifsc-2018":
            return tops, zones, -to_top, -to_zone
        if rules == "most":
            return tops, flashes, -to_top
        if rules == "ifsc-2025":
            points = Fraction(0)
            for _, zone, top in marks:
                got = 250 - (top - 1) if top else 100 - (zone - 1) if zone else 0
                points += Fraction(max(0, got), 10)
            return (points,)
        each = [self._worth(who, one, task, mark) for task, mark in tried]
        best = sorted(each, reverse=True)[: one.scoring.best or len(each)]
        return sum(best, Fraction(0)), tops, flashes

    def _worth(self, who: Competitor, one: RoundSheet, task: Task, mark: Mark) -> Fraction:
        _, zone, top = mark
        worth = task.points or one.scoring.worth
        if one.scoring.rules == "points":
            return Fraction(
                worth["flash" if top == 1 else "top" if top else "zone"] if zone or top else 0
            )
        rivals = [
            self.mark(other, task)
            for other in self.sheet.entries
            if other.category == who.category and not self.is_out(other)
        ]
        points = Fraction(0)
        if top:
            points += Fraction(worth["top"], sum(1 for _, _, t in rivals if t))
        if zone:
            points += Fraction(worth["zone"], sum(1 for _, z, _ in rivals if z))
        return points

    def standing(self, who: Competitor) -> Key | None:
        """Return what a competitor is ranked by in the end."""
        if self.is_out(who):
            return None
        keys = [self.key(who, one) for one in self.sheet.rounds]
        if not any(key is not None for key in keys):
            return None
        if self.sheet.format == "league":
            sums = sorted((key[0] + who.handicap for key in keys if key is not None), reverse=True)
            return sum(sums[: self.sheet.league_best], Fraction(0)), sums[0]
        reached = max(n for n, key in enumerate(keys) if key is not None)
        flat: list[Fraction] = [Fraction(reached)] if self.sheet.format == "rounds" else []
        for n in range(reached, -1, -1):
            empty = self._by_rules(who, self.sheet.rounds[n], [])
            flat += keys[n] or empty
        return tuple(flat)

    def ranks(self) -> dict[UUID, int | None]:
        """Return the rank of each competitor: one more than the number of better ones."""
        standings = [(who, self.standing(who)) for who in self.sheet.entries]
        return {
            who.id: None
            if mine is None
            else 1
            + sum(
                1
                for other, theirs in standings
                if theirs is not None and other.category == who.category and theirs > mine
            )
            for who, mine in standings
        }
