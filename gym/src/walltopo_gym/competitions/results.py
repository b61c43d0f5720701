"""The marks and scores of a competition, updated as score events arrive."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from fractions import Fraction
from uuid import UUID

from walltopo_gym.competitions.ledger import Fact, Ledger, MarkKey
from walltopo_gym.competitions.scoring.lead import average_ranks
from walltopo_gym.competitions.scoring.rules import Field, Rules
from walltopo_gym.competitions.scoring.score import NOTHING, AttemptedProblem, Mark, Score
from walltopo_gym.competitions.sheet import Competitor, RoundSheet, Sheet

_Group = tuple[UUID, UUID]  # round, category


class Results:
    """Marks and scores of a competition.

    An event affects the score of one competitor in one round; with shared points, of those who
    share them; in IFSC lead, of the whole category. `touched` has the categories that changed since
    it was last emptied.
    """

    def __init__(self, sheet: Sheet) -> None:
        self._ledger = Ledger()
        self._mark_keys: set[MarkKey] = set()
        self.touched: set[UUID] = set()
        self.use(sheet)

    def use(self, sheet: Sheet) -> None:
        """Continue with another sheet; events stay."""
        self.sheet = sheet
        self.competitors = {one.id: one for one in sheet.entries}
        self._round_of = {task.id: one for one in sheet.rounds for task in one.problems}
        self._task = {task.id: task for one in sheet.rounds for task in one.problems}
        self._marks: dict[UUID, dict[UUID, Mark]] = defaultdict(dict)
        # By round and category, then by competitor.
        self._scores: dict[_Group, dict[UUID, Score | None]] = defaultdict(dict)
        self._ranks: dict[_Group, dict[UUID, dict[UUID, Fraction]]] = {}
        self._tops: dict[tuple[UUID, UUID], set[UUID]] = defaultdict(set)
        self._zones: dict[tuple[UUID, UUID], set[UUID]] = defaultdict(set)
        self.outs: dict[UUID, str] = {}
        for entry, problem in sorted(self._mark_keys, key=str):
            self._look(entry, problem)
        self.touched = {category for category, _ in sheet.categories}

    def add(self, facts: Iterable[Fact]) -> None:
        """Add events in any order; all at once costs less than one by one."""
        for entry, problem in self._ledger.add(facts):
            self._mark_keys.add((entry, problem))
            self._look(entry, problem)

    def mark(self, entry: UUID, problem: UUID) -> Mark:
        """Return a competitor's mark on a problem."""
        return self._marks[entry].get(problem, NOTHING)

    def score(self, one: RoundSheet, who: Competitor) -> Score | None:
        """Return a competitor's score in a round; None if disqualified, and if they neither climbed
        in it nor reached it by a quota."""
        scores = self._scores[one.id, who.category]
        if who.id not in scores:
            scores[who.id] = self._score_of(one, who)
        return scores[who.id]

    def empty(self, one: RoundSheet, category: UUID) -> Score:
        """Return the score of no result in a round."""
        return one.scoring.score((), Field(routes=_number_of_routes(one, category)))

    def route_ranks(self, one: RoundSheet, who: Competitor) -> dict[UUID, Fraction]:
        """Return a competitor's rank on each route of an IFSC lead round."""
        if one.scoring.rules != Rules.IFSC_LEAD:
            return {}
        key = one.id, who.category
        if key not in self._ranks:
            self._ranks[key] = self._ranked_routes(one, who.category)
        return {route: ranks[who.id] for route, ranks in self._ranks[key].items()}

    def marks_in(self, one: RoundSheet, entry: UUID) -> dict[UUID, Mark]:
        """Return a competitor's marks on the problems of a round."""
        mine = self._marks.get(entry, {})
        return {task.id: mine[task.id] for task in one.problems if task.id in mine}

    def _score_of(self, one: RoundSheet, who: Competitor) -> Score | None:
        if not self._takes_part(one, who):
            return None
        tried = [
            AttemptedProblem(problem, mark, self._task[problem].points, self._task[problem].holds)
            for problem, mark in self.marks_in(one, who.id).items()
        ]
        rivals = Field(
            tops={t.problem: len(self._tops[who.category, t.problem]) for t in tried},
            zones={t.problem: len(self._zones[who.category, t.problem]) for t in tried},
            ranks=self.route_ranks(one, who),
            routes=_number_of_routes(one, who.category),
        )
        return one.scoring.score(tried, rivals)

    def _takes_part(self, one: RoundSheet, who: Competitor) -> bool:
        if not one.has(who.id) or who.id in self.outs:
            return False
        return bool(self.marks_in(one, who.id)) or (
            one.starters is not None and one.begun_at is not None
        )

    def _ranked_routes(self, one: RoundSheet, category: UUID) -> dict[UUID, dict[UUID, Fraction]]:
        """Return the ranks on each route of those of a category who take part in a round."""
        who = [
            each.id
            for each in self.sheet.entries
            if each.category == category and self._takes_part(one, each)
        ]
        return {
            route.id: average_ranks({each: self.mark(each, route.id).height for each in who})
            for route in one.problems_of(category)
        }

    def _look(self, entry: UUID, problem: UUID | None) -> None:
        """Update a competitor's mark on a problem, or their disqualification."""
        who = self.competitors.get(entry)
        if who is None:
            return
        if problem is None:
            self._look_out(who)
            return
        task = self._task.get(problem)
        if task is None or not task.is_for(who.category):
            return
        mark = self._ledger.mark(entry, problem, task.max_attempts)
        if mark == self._marks[entry].get(problem, NOTHING):
            return
        if mark == NOTHING:
            del self._marks[entry][problem]
        else:
            self._marks[entry][problem] = mark
        self._hold(who, problem, mark)
        self._forget(self._round_of[problem], who)

    def _look_out(self, who: Competitor) -> None:
        reason = self._ledger.out(who.id)
        if reason == self.outs.get(who.id):
            return
        if reason is None:
            del self.outs[who.id]
        else:
            self.outs[who.id] = reason
        for problem, mark in self._marks[who.id].items():  # they share no points while they are out
            self._hold(who, problem, mark)
        for one in self.sheet.rounds:
            self._forget(one, who)

    def _hold(self, who: Competitor, problem: UUID, mark: Mark) -> None:
        """Update who has the problem, because shared points change for all of them."""
        key = who.category, problem
        is_out = who.id in self.outs
        for holders, has in ((self._tops[key], mark.top), (self._zones[key], mark.zone)):
            if (who.id in holders) == bool(has and not is_out):
                continue
            holders.symmetric_difference_update({who.id})
            one = self._round_of[problem]
            if one.scoring.rules == Rules.SHARED:
                for other in holders:
                    self._forget(one, self.competitors[other])

    def _forget(self, one: RoundSheet, who: Competitor) -> None:
        key = one.id, who.category
        if one.scoring.rules == Rules.IFSC_LEAD:  # a mark moves the ranks of all on its route
            self._scores.pop(key, None)
            self._ranks.pop(key, None)
        else:
            self._scores[key].pop(who.id, None)
        self.touched.add(who.category)


def _number_of_routes(one: RoundSheet, category: UUID) -> int:
    """Return the number of routes whose ranks count; 0 where no rank counts."""
    return len(one.problems_of(category)) if one.scoring.rules == Rules.IFSC_LEAD else 0
