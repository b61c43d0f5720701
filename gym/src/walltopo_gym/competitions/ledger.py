"""The marks that follow from score events, in whatever order they arrive.

An event counts unless a counting event strikes it: one that has it as its target and is of a kind
in `STRIKING`. Over all counting events, a competitor's tries on a problem are the largest number,
and zone and top the smallest. So two judges who enter the same try do not count it twice, and a
phone that was offline changes nothing by being late.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from enum import StrEnum
from uuid import UUID

from walltopo_gym.competitions.scoring.score import NOTHING, Mark


class Kind(StrEnum):
    """Kinds of score events."""

    ATTEMPT = "attempt"
    ZONE = "zone"
    TOP = "top"
    VOID = "void"
    OUT = "out"
    APPEAL = "appeal"
    DECISION = "decision"


SCORED = frozenset({Kind.ATTEMPT, Kind.ZONE, Kind.TOP})
JUDGED = frozenset({Kind.OUT, Kind.DECISION})  # sent by judges alone
# An appeal and a decision name an event and leave it as it is.
STRIKING = SCORED | {Kind.VOID, Kind.OUT}

Place = tuple[UUID, UUID | None]  # entry, problem


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

    @property
    def place(self) -> Place:
        """Return the entry and the problem of the event."""
        return self.entry, self.problem

    @property
    def strikes(self) -> UUID | None:
        """Return the id of the event that this one strikes, or None."""
        return self.target if self.kind in STRIKING else None


class Ledger:
    """Score events in any order; duplicates are ignored."""

    def __init__(self) -> None:
        self._facts: dict[UUID, Fact] = {}
        self._strikers: dict[UUID, list[UUID]] = defaultdict(list)
        self._at: dict[Place, list[UUID]] = defaultdict(list)

    def add(self, fact: Fact) -> set[Place]:
        """Add an event and return the places that it may change."""
        if fact.id in self._facts:
            return set()
        self._facts[fact.id] = fact
        self._at[fact.place].append(fact.id)
        touched = {fact.place}
        struck = fact.strikes
        if struck is not None:
            self._strikers[struck].append(fact.id)
        while struck is not None and struck in self._facts:
            target = self._facts[struck]
            touched.add(target.place)
            struck = target.strikes
        return touched

    def counts(self, event: UUID) -> bool:
        """Return whether a stored event counts."""
        order = [event]
        for one in order:  # grows: what strikes comes after what it strikes
            order += self._strikers.get(one, ())
        struck: set[UUID | None] = set()
        for one in reversed(order):
            if one not in struck:
                struck.add(self._facts[one].strikes)
        return event not in struck

    def mark(self, entry: UUID, problem: UUID) -> Mark:
        """Return a competitor's mark on a problem."""
        tries = zone = top = 0
        for fact in self.counting(entry, problem):
            n = fact.n
            if fact.kind not in SCORED or n is None:
                continue
            tries = max(tries, n)
            if fact.kind != Kind.ATTEMPT:
                zone = min(zone or n, n)
            if fact.kind == Kind.TOP:
                top = min(top or n, n)
        return Mark(tries, zone, top) if tries else NOTHING

    def out(self, entry: UUID) -> str | None:
        """Return the reason of a disqualification; None without one."""
        outs = [fact for fact in self.counting(entry, None) if fact.kind == Kind.OUT]
        return outs[-1].text if outs else None

    def counting(self, entry: UUID, problem: UUID | None) -> list[Fact]:
        """Return the counting events of a place in order of arrival."""
        events = self._at.get((entry, problem), ())
        return [self._facts[event] for event in events if self.counts(event)]
