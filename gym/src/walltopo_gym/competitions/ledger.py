"""The marks that follow from score events, in whatever order they arrive.

An event counts unless a counting event strikes it: one that has it as its target and is of a kind
in `STRIKING`. Over all counting events, a competitor's tries on a problem are the largest number,
and zone and top the smallest. So two judges who enter the same try do not count it twice, and a
phone that was offline changes nothing by being late.

On a route the best high point counts: a top before a hold, a higher hold before a lower one, a plus
before none. Its climbing time is the shortest that a counting event of that high point has, and its
try the first of them. So two judges who enter the same attempt agree in any order; where they
disagree, the competitor has the better mark until a judge strikes one of the two.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from uuid import UUID

from walltopo_gym.competitions.scoring.score import NOTHING, Mark


class Kind(StrEnum):
    """Kinds of score events."""

    ATTEMPT = "attempt"
    ZONE = "zone"
    TOP = "top"
    HIGH = "high"
    VOID = "void"
    OUT = "out"
    APPEAL = "appeal"
    DECISION = "decision"


BOULDER_KINDS = frozenset({Kind.ATTEMPT, Kind.ZONE, Kind.TOP})
LEAD_KINDS = frozenset({Kind.HIGH, Kind.TOP})
SCORED = BOULDER_KINDS | LEAD_KINDS
JUDGED = frozenset({Kind.OUT, Kind.DECISION})  # sent by judges alone
# An appeal and a decision name an event and leave it as it is.
STRIKING = SCORED | {Kind.VOID, Kind.OUT}

MarkKey = tuple[UUID, UUID | None]  # entry, problem


@dataclass(frozen=True, slots=True)
class Fact:
    """The fields of a score event that the ledger uses."""

    id: UUID
    entry: UUID
    problem: UUID | None
    kind: str
    n: int | None = None
    target: UUID | None = None
    text: str = ""
    hold: int | None = None
    plus: bool = False
    seconds: int | None = None

    @property
    def mark_key(self) -> MarkKey:
        """Return the entry and the problem of the event."""
        return self.entry, self.problem

    @property
    def strikes(self) -> UUID | None:
        """Return the id of the event that this one strikes, or None."""
        return self.target if self.kind in STRIKING else None

    @property
    def height(self) -> int:
        """Return a number that orders high points; 0 if the event has none."""
        if self.kind == Kind.TOP:
            return Mark(top=1).height
        if self.kind == Kind.HIGH:
            return Mark(tries=1, hold=self.hold or 0, plus=self.plus).height
        return 0


class Ledger:
    """Score events in any order; duplicates are ignored.

    Each event strikes one other at most, so the events are trees. An event counts while the number
    of its counting strikers is zero. That number is kept, so an event that arrives changes only
    those before it in its chain.
    """

    def __init__(self) -> None:
        self._facts: dict[UUID, Fact] = {}
        self._strikers = Counter[UUID]()  # counting strikers, by the event that they strike
        self._at: dict[MarkKey, list[UUID]] = defaultdict(list)

    def add(self, facts: Iterable[Fact]) -> set[MarkKey]:
        """Add events in order of arrival and return the keys of the marks that they may change.

        Linear in the number of events if all come in one call: from last to first, so that the
        strikers of most events are known before them. An event that comes later, alone, costs up to
        the length of its chain.
        """
        new: dict[UUID, Fact] = {}
        for fact in facts:
            if fact.id not in self._facts:
                new.setdefault(fact.id, fact)
        for fact in new.values():
            self._at[fact.mark_key].append(fact.id)
        touched = {fact.mark_key for fact in new.values()}
        for fact in reversed(new.values()):
            self._facts[fact.id] = fact
            if self.counts(fact.id):
                touched |= self._strike(fact)
        return touched

    def _strike(self, fact: Fact) -> set[MarkKey]:
        """Count the strike of an event that counts now, and what follows along its chain; return
        the marks for which other events count, or no longer count."""
        touched = set()
        change, target = 1, fact.strikes
        while target is not None:
            was_counting = not self._strikers[target]
            self._strikers[target] += change
            is_counting = not self._strikers[target]
            if target not in self._facts or is_counting == was_counting:
                break
            struck = self._facts[target]
            touched.add(struck.mark_key)
            change, target = 1 if is_counting else -1, struck.strikes
        return touched

    def counts(self, event: UUID) -> bool:
        """Return whether a stored event counts."""
        return not self._strikers[event]

    def mark(self, entry: UUID, problem: UUID, max_attempts: int | None = None) -> Mark:
        """Return a competitor's mark on a problem; attempts beyond the limit do not count."""
        tries = zone = top = 0
        scored = [
            (fact, fact.n)
            for fact in self.counting_events(entry, problem)
            if fact.kind in SCORED and fact.n and (max_attempts is None or fact.n <= max_attempts)
        ]
        for fact, n in scored:
            tries = max(tries, n)
            if fact.kind in (Kind.ZONE, Kind.TOP):
                zone = min(zone or n, n)
            if fact.kind == Kind.TOP:
                top = min(top or n, n)
        return Mark(tries, zone, top, *_high_point(scored)) if tries else NOTHING

    def out(self, entry: UUID) -> str | None:
        """Return the reason of a disqualification; None without one."""
        outs = [fact for fact in self.counting_events(entry, None) if fact.kind == Kind.OUT]
        return outs[-1].text if outs else None

    def counting_events(self, entry: UUID, problem: UUID | None) -> list[Fact]:
        """Return the counting events of a mark in order of arrival."""
        events = self._at.get((entry, problem), ())
        return [self._facts[event] for event in events if self.counts(event)]


def _high_point(scored: Sequence[tuple[Fact, int]]) -> tuple[int, bool, int, int | None]:
    """Return hold, plus, try and climbing time of the best high point; a top has no hold and no
    try here.

    Parameters
    ----------
    scored : events and the numbers of their tries.
    """
    height = max((fact.height for fact, _ in scored), default=0)
    best = [(fact, n) for fact, n in scored if height and fact.height == height]
    time = min((fact.seconds for fact, _ in best if fact.seconds is not None), default=None)
    if not best or best[0][0].kind == Kind.TOP:
        return 0, False, 0, time
    high = best[0][0]
    return high.hold or 0, high.plus, min(n for _, n in best), time
