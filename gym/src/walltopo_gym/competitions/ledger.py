"""What score events mean together, whatever the order in which they arrive.

An event counts unless another one that counts strikes it: has it as its target, and is of a kind in
`STRIKING`. On a problem a competitor has, over all events that count: as tries the largest number
that was said, as zone and top the smallest. So two judges who enter the same thing do not count it
twice, and a phone that was offline changes nothing by being late.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from enum import StrEnum
from uuid import UUID

from walltopo_gym.competitions.scoring.score import NOTHING, Mark


class Kind(StrEnum):
    """What an event says."""

    ATTEMPT = "attempt"
    ZONE = "zone"
    TOP = "top"
    VOID = "void"
    OUT = "out"
    APPEAL = "appeal"
    DECISION = "decision"


SCORED = frozenset({Kind.ATTEMPT, Kind.ZONE, Kind.TOP})
JUDGED = frozenset({Kind.OUT, Kind.DECISION})  # said by judges alone
# An appeal and a decision name an event and leave it as it is.
STRIKING = SCORED | {Kind.VOID, Kind.OUT}

Place = tuple[UUID, UUID | None]  # entry, problem


@dataclass(frozen=True, slots=True)
class Fact:
    """What counts of a score event."""

    id: UUID
    entry: UUID
    problem: UUID | None
    kind: str
    n: int | None = None
    target: UUID | None = None
    text: str = ""

    @property
    def place(self) -> Place:
        """What it is about."""
        return self.entry, self.problem

    @property
    def strikes(self) -> UUID | None:
        """The event that does not count because of this one."""
        return self.target if self.kind in STRIKING else None


class Ledger:
    """Events, in any order, each as often as it likes to come."""

    def __init__(self) -> None:
        self._facts: dict[UUID, Fact] = {}
        self._strikers: dict[UUID, list[UUID]] = defaultdict(list)
        self._at: dict[Place, list[UUID]] = defaultdict(list)

    def add(self, fact: Fact) -> set[Place]:
        """Take an event in; what may be otherwise by it."""
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
        """Whether an event that is here counts."""
        order = [event]
        for one in order:  # grows: what strikes comes after what it strikes
            order += self._strikers.get(one, ())
        struck: set[UUID | None] = set()
        for one in reversed(order):
            if one not in struck:
                struck.add(self._facts[one].strikes)
        return event not in struck

    def mark(self, entry: UUID, problem: UUID) -> Mark:
        """What somebody has on a problem."""
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
        """Why somebody is out; None while they are not."""
        said = [fact for fact in self.counting(entry, None) if fact.kind == Kind.OUT]
        return said[-1].text if said else None

    def counting(self, entry: UUID, problem: UUID | None) -> list[Fact]:
        """The events about a place that count, as they arrived."""
        events = self._at.get((entry, problem), ())
        return [self._facts[event] for event in events if self.counts(event)]
