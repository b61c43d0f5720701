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
High = tuple[int, int, int]  # top, hold, plus
SCORED = "attempt", "zone", "top", "high"
NEVER = Fraction(-(10**12))  # below each rank and behind each time


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
                other.kind in (*SCORED, "void", "out") and self.counts(other)
                for other in self._on[fact.id]
            )
        return self._counting[fact.id]

    def is_out(self, who: Competitor) -> bool:
        about = self._about[who.id, None]
        return any(fact.kind == "out" and self.counts(fact) for fact in about)

    def mark(self, who: Competitor, task: Task) -> Mark:
        here = self._scores_on(who, task)
        tries = [fact.n or 0 for fact in here]
        zones = [fact.n or 0 for fact in here if fact.kind in ("zone", "top")]
        tops = [fact.n or 0 for fact in here if fact.kind == "top"]
        return max(tries, default=0), min(zones, default=0), min(tops, default=0)

    def _scores_on(self, who: Competitor, task: Task) -> list[Fact]:
        if task.categories and who.category not in task.categories:
            return []
        about = self._about[who.id, task.id]
        return [fact for fact in about if fact.kind in SCORED and self.counts(fact)]

    def high(self, who: Competitor, task: Task) -> High | None:
        """Return the best high point on a route; None without a try."""
        highs = [_high_of(fact) for fact in self._scores_on(who, task)]
        return max(highs, default=None)

    def _best_events(self, who: Competitor, task: Task) -> list[Fact]:
        best = self.high(who, task)
        here = self._scores_on(who, task)
        return [fact for fact in here if fact.kind in ("high", "top") and _high_of(fact) == best]

    def time(self, who: Competitor, task: Task) -> int | None:
        times = [fact.seconds for fact in self._best_events(who, task) if fact.seconds is not None]
        return min(times, default=None)

    def _routes(self, who: Competitor, one: RoundSheet) -> list[Task]:
        return [t for t in one.problems if not t.categories or who.category in t.categories]

    def is_in(self, who: Competitor, one: RoundSheet) -> bool:
        """Return whether a competitor is ranked in a round, or will be."""
        if self.is_out(who) or (one.starters is not None and who.id not in one.starters):
            return False
        began = one.starters is not None and one.begun_at is not None
        return began or any(self._scores_on(who, task) for task in self._routes(who, one))

    def _lead_key(self, who: Competitor, one: RoundSheet) -> Fraction:
        """Return what IFSC lead ranks by: the high point of one route, the ranks on several."""
        routes = self._routes(who, one)
        if not self.is_in(who, one):
            return NEVER
        if len(routes) == 1:
            top, hold, plus = self.high(who, routes[0]) or (-1, 0, 0)
            return Fraction(1000 * top + hold) + Fraction(plus, 2)
        rivals = [
            other
            for other in self.sheet.entries
            if other.category == who.category and self.is_in(other, one)
        ]
        product = Fraction(1)
        for route in routes:
            mine = self.high(who, route) or (-1, 0, 0)
            others = [self.high(other, route) or (-1, 0, 0) for other in rivals]
            # The places of those who share a high point, one after the other.
            first = 1 + sum(1 for high in others if high > mine)
            places = range(first, first + others.count(mine))
            product *= Fraction(sum(places), len(places))
        return -product

    def _final_key(self, who: Competitor, one: RoundSheet) -> Key:
        """Return what breaks the last ties of a final."""
        if one.kind != "final" or one.scoring.rules != "ifsc-lead":
            return ()
        tried = [task for task in self._routes(who, one) if self._scores_on(who, task)]
        times = [self.time(who, task) for task in tried]
        if not times or None in times:
            return (NEVER,)
        return (Fraction(-sum(time or 0 for time in times)),)

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
        if rules == "ifsc-lead":
            return (self._lead_key(who, one) if tried else NEVER,)
        if rules == "lead-points":
            holds = [self._holds(who, task) for task, _ in tried]
            best = sorted(holds, reverse=True)[: one.scoring.best or len(holds)]
            events = [self._best_events(who, task) for task, _ in tried]
            tries = sum(min((fact.n or 0 for fact in found), default=0) for found in events)
            return sum(best, Fraction(0)), tops, Fraction(-tries)
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

    def _holds(self, who: Competitor, task: Task) -> Fraction:
        top, hold, plus = self.high(who, task) or (0, 0, 0)
        number = Fraction(task.holds or 0)
        return number if top else min(number, hold + Fraction(plus, 2))

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
        return tuple(flat) + self._final_key(who, self.sheet.rounds[reached])

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


def _high_of(fact: Fact) -> High:
    if fact.kind == "top":
        return 1, 0, 0
    return (0, fact.hold or 0, int(fact.plus)) if fact.kind == "high" else (0, 0, 0)
